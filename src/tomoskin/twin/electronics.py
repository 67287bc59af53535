"""The board's electronics: potentials → amplifier → converter → counts."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from tomoskin.core import FloatArray, IntArray
from tomoskin.model.forward import choose_engine
from tomoskin.model.skin import ReadoutSettings
from tomoskin.twin.bend import Pose
from tomoskin.twin.circuit import Electrodes, ElectronicsSettings, Lines, line_potentials, settling
from tomoskin.twin.faults import Faults, check_electrodes
from tomoskin.twin.parameters import wandered
from tomoskin.twin.probe import Probe
from tomoskin.twin.scanning import SampleTable
from tomoskin.twin.sheet import TwinSkin

Course = Callable[[float], tuple[Probe, ...]]
"""What presses so many seconds after the start of a scan."""

Bending = Callable[[float], Pose]
"""How the sheet is bent then."""


Courses = Sequence[tuple[FloatArray, FloatArray]]
"""What is not the same at each conversion: (n_samples,) V, and (oversampling, n_samples) of what
part there is of it."""

_MOST_TABLES = 300
"""Tables that are remembered: the drives of a scan, one by one, and the scan before it."""


def convert(
    volts: FloatArray,
    readout: ReadoutSettings,
    oversampling: int,
    electronics: ElectronicsSettings,
    random: np.random.Generator,
    *,
    moving: Courses = (),
) -> NDArray[np.uint16]:
    """(n_samples,) summed codes of the potentials ``volts`` (n_samples,) and what is ``moving``.

    Amplified, shifted and held between the amplifier's rails; each conversion then has its own
    Gaussian noise, is rounded down as the converter does (code = V · 2ⁿ / V_ref) and stops at
    the converter's rails.
    """
    levels = 1 << readout.adc_bits
    chance = random.standard_normal((oversampling, len(volts)))
    if (core := choose_engine().core) is not None:
        amplifier = readout.gain, readout.offset, electronics.low_rail, electronics.high_rail
        converter = levels / readout.reference_voltage, levels, electronics.nonlinearity
        codes: NDArray[np.uint16] = core.converted(
            volts, moving, chance, (*amplifier, *converter, electronics.noise)
        )
        return codes
    for size, course in moving:
        volts = volts + size * course
    output = readout.gain * volts + readout.offset
    np.clip(output, electronics.low_rail, electronics.high_rail, out=output)
    exact = output * (levels / readout.reference_voltage)
    if electronics.nonlinearity:
        part = np.clip(exact / levels, 0.0, 1.0)
        exact = exact + electronics.nonlinearity * 4 * part * (1 - part)
    noisy = electronics.noise * chance
    noisy += exact
    np.floor(noisy, out=noisy)
    np.clip(noisy, 0, levels - 1, out=noisy)
    return np.asarray(noisy.sum(axis=0).astype(np.uint16))


@dataclass(frozen=True, eq=False)
class _Samples:
    """What each sample of a table has of its channel.

    Attributes
    ----------
    place
        (n_samples,) which of the drives' channels it reads, drive after drive.
    gain, offset
        (n_samples,) of the channel; V.
    sine, cosine
        (oversampling, n_samples) V of the hum at each conversion, if its phase is 0 at the scan's
        start, and a quarter of a turn later.
    """

    place: IntArray
    gain: FloatArray
    offset: FloatArray
    sine: FloatArray
    cosine: FloatArray


class TwinElectronics:
    """Current source, switches, amplifiers and converter on a twin's sheet."""

    def __init__(
        self,
        sheet: TwinSkin,
        readout: ReadoutSettings,
        current: float,
        electronics: ElectronicsSettings,
        seed: int,
    ) -> None:
        """Make electronics that drive the sheet with ``current``, in A."""
        self.sheet, self._readout, self._current = sheet, readout, current
        self.settings = electronics
        of_channels, *chance = np.random.SeedSequence(seed).spawn(4)
        channels, n = np.random.default_rng(of_channels), sheet.n_electrodes
        self._gain = 1.0 + electronics.gain_sd * channels.standard_normal(n)
        self._offset = electronics.offset_sd * channels.standard_normal(n)
        self._hum = electronics.hum * (1 + 0.2 * channels.standard_normal(n))
        self._phase = channels.uniform(0, 2 * np.pi) + 0.2 * channels.standard_normal(n)
        self._faults = Faults()
        self._electrodes = Electrodes(n, current, electronics, chance[2])
        self._begin(*chance)
        self._aged = 0.0
        self._course: Course | None = None
        self._bending: Bending | None = None
        self._lines: dict[SampleTable, tuple[tuple[object, ...], Lines]] = {}
        self._samples: dict[SampleTable, _Samples] = {}

    @property
    def faults(self) -> Faults:
        """The faults that hold at this moment."""
        return self._faults

    def set_faults(self, faults: Faults) -> None:
        """Break and mend, from any thread; ModelError for an electrode that is not there."""
        check_electrodes(faults, self.sheet.n_electrodes)
        self._faults = faults

    def follow(self, course: Course | None, bending: Bending | None = None) -> None:
        """Take the presses of each drive from ``course``, its pose from ``bending``.

        They may move during a scan. None: those that the sheet has at its start.
        """
        self._course, self._bending = course, bending

    def renew(self, chance: np.random.SeedSequence) -> None:
        """Begin anew at no time, with noise and contacts from ``chance``; the channels stay."""
        self._begin(*chance.spawn(3))

    def _begin(self, *chance: np.random.SeedSequence) -> None:
        """``chance``: of noise, contacts and electrodes."""
        self._random, self._contacts = map(np.random.default_rng, chance[:2])
        self._electrodes.renew(chance[2])
        n = self.sheet.n_electrodes
        self._contact = self.settings.contact_sd * self._contacts.standard_normal(n)
        self._time: float | None = None
        self._before = np.zeros(n)

    def sample(self, table: SampleTable, time: float) -> NDArray[np.uint16]:
        """Counts of a scan begun at ``time`` s of the sheet as it is pressed then.

        The sheet and its contacts go on from the scan before to this time, and then stand still
        until the scan is over; where presses move during the scan (:meth:`follow`), each drive
        sees the sheet as it is in its middle.
        """
        if len(self._samples) > _MOST_TABLES:
            self._samples, self._lines = {}, {}
        first = self._time is None or time < self._time
        self._age_contacts(0.0 if self._time is None else max(0.0, time - self._time))
        self._aged = time if first else self._aged
        self._time = time
        volts, moving = self._volts(table, time, self._scanned(table, time))
        return convert(
            volts, self._readout, table.oversampling, self.settings, self._random, moving=moving
        )

    def _scanned(self, table: SampleTable, time: float) -> Lines:
        """What the channels stand at under each drive, as the presses stand or move."""
        middles = table.middles
        moves = self._moves(middles)
        if moves and all(move == moves[0] for move in moves):
            _set(self.sheet, *moves[0])
            moves = []
        if not moves:
            self._let_go_by(time)
            return self._potentials(table)
        lines = []
        for number, move in enumerate(moves):
            _set(self.sheet, *move)
            self._let_go_by(time + float(middles[number]))
            lines.append(self._under(table.drives[number : number + 1], self.sheet.resistance()))
        read = np.concatenate([line.read for line in lines])
        stuck = [line.stuck for line in lines if line.stuck is not None]
        return Lines(read, np.concatenate(stuck) if stuck else None)

    def _moves(self, times: FloatArray) -> list[tuple[tuple[Probe, ...], Pose]]:
        """What presses, and how the sheet is bent, at each of the ``times``."""
        course, bending, sheet = self._course, self._bending, self.sheet
        if course is None and bending is None:
            return []
        return [
            (course(t) if course else sheet.presses, bending(t) if bending else sheet.pose)
            for t in times.tolist()
        ]

    def _let_go_by(self, time: float) -> None:
        """Let the sheet go on to ``time`` s."""
        self.sheet.advance(max(0.0, time - self._aged))
        self._aged = max(self._aged, time)

    def _volts(self, table: SampleTable, time: float, lines: Lines) -> tuple[FloatArray, Courses]:
        """(n_samples,) V at the amplifiers' inputs, and what is added to them."""
        settings, samples = self.settings, self._of(table)
        place, n = samples.place, len(samples.place)
        volts = lines.read.take(place)
        moving = []
        if settings.time_constant > 0:
            carried, remaining = _settling(table, settings.time_constant)
            start = carried @ np.concatenate([self._before[None], lines.read])
            self._before = start[-1]
            moving.append((samples.gain * (start.take(place) - volts), remaining))
        if settings.hum > 0:
            turn = 2 * math.pi * settings.hum_frequency * time
            moving.append((np.full(n, math.cos(turn)), samples.sine))
            moving.append((np.full(n, math.sin(turn)), samples.cosine))
        if not self._electrodes.silent:
            volts += self._electrodes.read(table, time)
        volts += samples.offset
        volts *= samples.gain
        if lines.stuck is not None:
            volts[lines.stuck.take(place)] = np.inf
        return volts, moving

    def _of(self, table: SampleTable) -> _Samples:
        """What the samples have of their channels, which stay as they are."""
        if table not in self._samples:
            channel, gain = table.channel, self._gain
            since = table.time + _within(table)
            turn = 2 * np.pi * self.settings.hum_frequency * since + self._phase.take(channel)
            hum = (gain * self._hum).take(channel)
            self._samples[table] = _Samples(
                place=table.drive * len(gain) + channel,
                gain=gain.take(channel),
                offset=self._offset.take(channel),
                sine=hum * np.sin(turn),
                cosine=hum * np.cos(turn),
            )
        return self._samples[table]

    def _potentials(self, table: SampleTable) -> Lines:
        """What the channels stand at under each drive; worked out anew when something changed."""
        resistance = self.sheet.resistance()
        faults = self._faults
        key = (resistance, faults, self._contact)
        held, lines = self._lines.get(table, (key, None))
        if lines is None or any(a is not b for a, b in zip(held, key, strict=True)):
            lines = self._under(table.drives, resistance)
            self._lines[table] = key, lines
        return lines

    def _under(self, drives: IntArray, resistance: FloatArray) -> Lines:
        return line_potentials(
            resistance,
            drives,
            self._current,
            contact=self._contact,
            faults=self._faults,
            settings=self.settings,
        )

    def _age_contacts(self, dt: float) -> None:
        """Let the contacts' resistance wander for ``dt`` s."""
        sd, time = self.settings.contact_sd, self.settings.contact_time
        if sd > 0 and dt > 0:
            chance = self._contacts.standard_normal(len(self._contact))
            self._contact = wandered(self._contact, sd, time, dt, chance)


def _set(sheet: TwinSkin, presses: tuple[Probe, ...], pose: Pose) -> None:
    sheet.set_presses(presses)
    sheet.set_pose(pose)


@lru_cache(maxsize=16)
def _settling(table: SampleTable, time_constant: float) -> tuple[FloatArray, FloatArray]:
    """What :func:`settling` gives, and (oversampling, n_samples) how much of it is left to go."""
    remaining = np.exp(-(table.since + _within(table)) / time_constant)
    return settling(table.length, time_constant), remaining


def _within(table: SampleTable) -> FloatArray:
    """(oversampling, 1) s from a sample's first conversion to each."""
    return np.asarray(np.arange(table.oversampling)[:, None] * table.conversion)
