"""Voltages that electrodes have by themselves: a double layer that charges, and heat.

A driven electrode is a capacitor, the double layer, with a leak across it, in series with the
sheet. Its voltage grows while current flows and decays with the leak, so what one drive leaves is
read under the next. A thermoelectric voltage wanders with the temperature of a contact. Neither
turns with the current within half a period of an alternating drive.
"""

from __future__ import annotations

import math

import numpy as np

from tomoskin.core import FloatArray
from tomoskin.twin.circuit import ElectronicsSettings
from tomoskin.twin.parameters import wandered
from tomoskin.twin.scanning import SampleTable


class ThermalVoltages:
    """The thermoelectric voltages of ``n`` contacts, which wander with their temperatures."""

    def __init__(
        self, n: int, settings: ElectronicsSettings, chance: np.random.SeedSequence
    ) -> None:
        """Begin anywhere, as ``chance`` has it."""
        self._sd, self._time = settings.thermal_sd, settings.thermal_time
        self._random = np.random.default_rng(chance)
        self.volts: FloatArray = self._sd * self._random.standard_normal(n)

    def wander(self, dt: float) -> None:
        """Let the contacts get warmer or colder for ``dt`` s."""
        if self._sd > 0:
            chance = self._random.standard_normal(len(self.volts))
            self.volts = wandered(self.volts, self._sd, self._time, dt, chance)


class Electrodes:
    """The ``n`` electrodes' own voltages from scan to scan."""

    def __init__(
        self, n: int, current: float, settings: ElectronicsSettings, chance: np.random.SeedSequence
    ) -> None:
        """Uncharged; ``current`` A of a drive."""
        self._n, self._current, self._settings = n, current, settings
        self._tau = settings.double_layer * settings.leak
        self.renew(chance)

    @property
    def silent(self) -> bool:
        """Whether they have no voltage of their own at all."""
        return math.isinf(self._settings.double_layer) and self._settings.thermal_sd == 0

    def renew(self, chance: np.random.SeedSequence) -> None:
        """Discharge them; their temperatures begin anew from ``chance``."""
        self._charged = np.zeros(self._n)
        self._thermal = ThermalVoltages(self._n, self._settings, chance)
        self._until: float | None = None

    def read(self, table: SampleTable, time: float) -> FloatArray:
        """(n_samples,) V that a scan begun at ``time`` s reads of them, against the sink's."""
        gap = 0.0 if self._until is None else max(0.0, time - self._until)
        self._thermal.wander(gap + table.seconds)
        self._charged = self._charged * math.exp(-gap / self._tau)
        self._until = time + table.seconds
        own = np.tile(self._thermal.volts, (len(table.channel), 1)) + self._charging(table)
        each = np.arange(len(own))
        return np.asarray(own[each, table.channel] - own[each, table.sink])

    def _charging(self, table: SampleTable) -> FloatArray:
        """(n_samples, n) V of the double layers at each sample; those of the end are kept."""
        if math.isinf(self._settings.double_layer):
            return np.zeros((len(table.channel), self._n))
        n_drives, each = len(table.drives), np.arange(len(table.drives))
        limit = np.zeros((n_drives, self._n))  # V, if a drive were on for ever
        limit[each, table.drives[:, 0]] = self._current * self._settings.leak
        limit[each, table.drives[:, 1]] = -self._current * self._settings.leak
        dead = (table.seconds - float(table.length.sum())) / max(n_drives, 1)
        held, rest = np.exp(-table.length / self._tau), math.exp(-dead / self._tau)
        start = np.empty((n_drives, self._n))
        for number in range(n_drives):
            start[number] = self._charged
            end = limit[number] + (self._charged - limit[number]) * held[number]
            self._charged = end * rest
        aim, begun = limit[table.drive], start[table.drive]
        return np.asarray(aim + (begun - aim) * np.exp(-table.since / self._tau)[:, None])
