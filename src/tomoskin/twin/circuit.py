"""Current source, switches, contacts and shorts around the sheet: what each channel stands at; and
the voltages that electrodes have by themselves."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tomoskin.core import FloatArray, IntArray
from tomoskin.model.forward import choose_engine
from tomoskin.twin.faults import Faults
from tomoskin.twin.parameters import check_numbers, parameter, wandered
from tomoskin.twin.scanning import SampleTable

_NO_FAULTS = Faults()

_SHORT = 1e-3
"""Resistance of two electrodes that touch, Ω; assumed."""


@dataclass(frozen=True, slots=True)
class ElectronicsSettings:
    """A board's imperfections; the defaults are a perfect board but for the converter's noise."""

    noise: float = parameter(
        0.7, "LSB", "Standard deviation of one conversion before it is rounded.", "assumed"
    )
    compliance: float = parameter(math.inf, "V", "Maximum voltage of the current source.", "ideal")
    output_resistance: float = parameter(
        math.inf, "Ω", "Resistance across the current source.", "ideal"
    )
    switch_resistance: float = parameter(
        0.0, "Ω", "Resistance of each switch when it is on.", "ideal"
    )
    contact_sd: float = parameter(
        0.0, "Ω", "Standard deviation of each contact's resistance over time.", "ideal"
    )
    contact_time: float = parameter(
        10.0, "s", "Correlation time of the contacts' resistance.", "assumed"
    )
    rejection: float = parameter(math.inf, "dB", "Common-mode rejection of the amplifier.", "ideal")
    gain_sd: float = parameter(0.0, "", "Relative deviation of the channels' gains.", "ideal")
    offset_sd: float = parameter(
        0.0, "V", "Deviation of the channels' offsets, at the input.", "ideal"
    )
    low_rail: float = parameter(-math.inf, "V", "Lowest output of the amplifier.", "ideal")
    high_rail: float = parameter(math.inf, "V", "Highest output of the amplifier.", "ideal")
    time_constant: float = parameter(
        0.0, "s", "Time constant with which a channel settles after a switch of the drive.", "ideal"
    )
    crosstalk: float = parameter(
        0.0, "", "Fraction of a neighbouring channel's potential that is read as well.", "ideal"
    )
    hum: float = parameter(0.0, "V", "Amplitude of the mains at the inputs.", "ideal")
    hum_frequency: float = parameter(50.0, "Hz", "Frequency of the mains.", "Europe; 60 in America")
    nonlinearity: float = parameter(
        0.0,
        "LSB",
        "Largest deviation of the converter from a straight line, in the middle of its range.",
        "ideal",
    )

    double_layer: float = parameter(
        math.inf, "F", "Capacitance between an electrode and what conducts by ions.", "ideal"
    )
    leak: float = parameter(
        100e3, "Ω", "Across the double layer; with it the time constant of polarisation.", "assumed"
    )
    thermal_sd: float = parameter(
        0.0, "V", "Standard deviation of each contact's thermoelectric voltage over time.", "ideal"
    )
    thermal_time: float = parameter(60.0, "s", "Correlation time of that.", "assumed")

    def __post_init__(self) -> None:
        """Check that every number is in its range."""
        check_numbers(
            self,
            above="contact_time hum_frequency leak thermal_time",
            least="noise switch_resistance contact_sd gain_sd offset_sd time_constant crosstalk "
            "hum nonlinearity thermal_sd",
        )


@dataclass(frozen=True, eq=False)
class Lines:
    """The channels under each drive.

    Attributes
    ----------
    read
        (n_drives, n) V between channel and sink line, as the amplifier reads it.
    stuck
        (n_drives, n) True where an input floats or a channel is broken: it stands at the rail.
        None: nowhere.
    """

    read: FloatArray
    stuck: NDArray[np.bool_] | None = None


def line_potentials(
    resistance: FloatArray,
    drives: IntArray,
    current: float,
    *,
    contact: FloatArray,
    faults: Faults,
    settings: ElectronicsSettings,
) -> Lines:
    """What the amplifiers see under each of ``drives`` (n_drives, 2).

    Parameters
    ----------
    resistance
        (n, n) Ω transfer resistance of sheet and contacts.
    contact
        (n,) Ω that each contact has more than in ``resistance``.
    """
    core = choose_engine().core
    if core is not None and faults == _NO_FAULTS:
        numbers = (
            current,
            settings.output_resistance,
            settings.compliance,
            settings.switch_resistance,
            _part(settings.rejection),
            settings.crosstalk,
        )
        return Lines(core.lines(resistance, drives, contact, numbers))
    resistance = shorted(resistance, faults.shorts)
    source, sink = drives.T
    n, rows = len(resistance), np.arange(len(drives))
    field = resistance[source] - resistance[sink]  # (n_drives, n) V/A, symmetric
    extra = settings.switch_resistance + contact
    load = field[rows, source] - field[rows, sink] + extra[source] + extra[sink]
    amperes = driven(current, load, settings)
    broken = np.zeros(n, dtype=bool)
    broken[sorted(faults.cut)] = True
    amperes = np.where(broken[source] | broken[sink], 0.0, amperes)
    potential = amperes[:, None] * (field - field[rows, sink][:, None])
    potential += (amperes * contact[sink])[:, None]  # against the sink line
    potential[rows, sink] = 0.0
    potential[rows, source] += amperes * contact[source]
    line = (amperes * settings.switch_resistance)[:, None]
    common = (potential + 2 * line) / 2
    read = potential + common * _part(settings.rejection)
    stuck = np.zeros_like(read, dtype=bool)
    stuck[:, broken] = True
    stuck[:, sorted(faults.railed)] = True
    stuck[broken[sink] & ~broken[source]] = True  # nothing holds the sheet down
    return Lines(_mixed(read, settings.crosstalk), stuck)


def _part(rejection: float) -> float:
    """Of the common mode, that a ``rejection`` dB leaves."""
    return float(10 ** (-rejection / 20))


def driven(current: float, load: FloatArray, settings: ElectronicsSettings) -> FloatArray:
    """(n_drives,) A through ``load`` Ω: what the source's own resistance and its supply leave.

    I = I₀/(1 + R_load/R_out), and never more than the compliance over the load.
    """
    amperes = current / (1 + load / settings.output_resistance)
    if math.isinf(settings.compliance):
        return np.asarray(amperes)
    return np.minimum(amperes, settings.compliance / np.maximum(load, 1e-12))


def shorted(resistance: FloatArray, pairs: frozenset[tuple[int, int]]) -> FloatArray:
    """Transfer resistance with each pair of electrodes joined: an exact change of rank one."""
    for a, b in sorted(pairs):
        column = resistance[:, a] - resistance[:, b]
        resistance = resistance - np.outer(column, column) / (_SHORT + column[a] - column[b])
    return resistance


def settling(length: FloatArray, time_constant: float) -> FloatArray:
    """(n_drives + 1, n_drives + 1): where a scan begins, and the potentials of its drives, to
    where each drive starts from; last, what the last one leaves.

    ``length`` (n_drives,) s is how long each drive is on: it leaves exp(−length/τ) of the way to
    its potentials.
    """
    rows = [np.eye(1, len(length) + 1)[0]]
    for number, kept in enumerate(np.exp(-length / time_constant), start=1):
        rows.append(kept * rows[-1])
        rows[-1][number] = 1 - kept
    return np.array(rows)


def _mixed(read: FloatArray, part: float) -> FloatArray:
    """Each channel with ``part`` of the difference to its neighbours on the board."""
    if part == 0:
        return read
    step = part * (read[:, 1:] - read[:, :-1])
    mixed = read.copy()
    mixed[:, :-1] += step
    mixed[:, 1:] -= step
    return mixed


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
