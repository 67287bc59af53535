"""What a scan samples, and when."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from tomoskin.board.source import ScanSettings, choose_periods
from tomoskin.board.wire import BoardLimits, Drive
from tomoskin.core import FloatArray, IntArray
from tomoskin.model.pattern import Scan

LIMITS = BoardLimits(
    request=0,
    name=b"simulated board".ljust(24, b"\0"),
    min_chop=10,
    max_chop=5000,
    half=0,
    sample=0,
    conversion=0,
    clock=813,
)
"""What the twin's board says of itself: as fast as its converter, of 13 clocks at 16 MHz."""

TICK_RATE = 250e3
"""Hz, of every board's clock."""

_ZERO = 0x8000
"""What stands for no difference in a frame of an alternating drive."""


@dataclass(frozen=True, slots=True)
class ScanClock:
    """Times of a scan, s: all off between two drives, wait after each switch, one conversion.

    ``on``: of each direction of an alternating drive; 0: until everything has been read.
    ``dropped``: conversions before the first one of each sample.
    """

    dead_time: float = 0.0
    settling: float = 0.0
    conversion: float = 0.0
    on: float = 0.0
    dropped: int = 0


@dataclass(frozen=True, eq=False)
class SampleTable:
    """The samples of a scan, in order; electrodes from 0.

    An alternating drive stands for as many drives as it has directions, one after the other.

    Attributes
    ----------
    drives
        (n_drives, 2) source and sink.
    drive, channel
        (n_samples,) which drive, and which channel is read.
    oversampling
        Conversions of each sample.
    since
        (n_samples,) s from the switch to the sample's first conversion.
    time
        (n_samples,) s from the start of the scan to that.
    length
        (n_drives,) s for which each drive is on.
    conversion
        s.
    directions
        That each drive of the board consists of; 1: the drive is direct.
    """

    drives: IntArray
    drive: IntArray
    channel: IntArray
    oversampling: int
    since: FloatArray
    time: FloatArray
    length: FloatArray
    conversion: float
    directions: int = 1

    def readings(
        self, counts: NDArray[np.uint16]
    ) -> tuple[NDArray[np.uint16], NDArray[np.uint16] | None]:
        """Samples and sums of a frame, as the board makes them of (n_samples,) ``counts``."""
        if self.directions == 1:
            return counts, None
        difference, total = self.demodulated(counts.astype(np.float64))
        return (difference + _ZERO).astype(np.uint16), total.astype(np.uint16)

    def demodulated(self, values: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Of an alternating drive and (n_samples,) values: for each sample of the frame those with
        the current from source to sink less, and plus, those with the current the other way."""
        place, sign = self._demodulation
        difference = np.bincount(place, weights=sign * values)
        return np.asarray(difference), np.asarray(np.bincount(place, weights=values))

    @cached_property
    def _demodulation(self) -> tuple[IntArray, IntArray]:
        """(n_samples,) sample of the frame that each belongs to, and 1 or −1 by its direction."""
        whole, direction = np.divmod(self.drive, self.directions)
        key = whole * (int(self.channel.max(initial=0)) + 1) + self.channel
        place = np.unique(key, return_inverse=True)[1]
        return np.asarray(place), np.where(direction % 2, -1, 1)

    @cached_property
    def parts(self) -> tuple[SampleTable, ...]:
        """Each drive of the board alone, as a scan that begins with it."""
        n = self.directions
        dead = self._dead / max(len(self.drives), 1)
        ends = np.cumsum(self.length + dead)
        parts = []
        for first in range(0, len(self.drives), n):
            own = slice(*np.searchsorted(self.drive, [first, first + n]))
            table = replace(
                self,
                drives=self.drives[first : first + n],
                drive=self.drive[own] - first,
                channel=self.channel[own],
                since=self.since[own],
                time=self.time[own] - (ends[first - 1] if first else 0.0),
                length=self.length[first : first + n],
            )
            parts.append(table)
        return tuple(parts)

    @cached_property
    def sink(self) -> IntArray:
        """Sink electrodes (n_samples,)."""
        return np.asarray(self.drives[self.drive, 1])

    @cached_property
    def middles(self) -> FloatArray:
        """(n_drives,) s from the start of the scan to the middle of each drive."""
        dead = self._dead / max(len(self.drives), 1)
        return np.asarray(np.cumsum(self.length + dead) - self.length / 2)

    @cached_property
    def seconds(self) -> float:
        """The seconds that one scan takes."""
        return float(self.length.sum()) + self._dead

    @cached_property
    def _dead(self) -> float:
        return float(self.time[0] - self.since[0]) * len(self.drives) if len(self.time) else 0.0


class Analogue(Protocol):
    """Whatever stands before the converter's output."""

    def sample(self, table: SampleTable, time: float) -> NDArray[np.uint16]:
        """(n_samples,) counts, each the sum of its conversions, of a scan begun at ``time`` s."""


def sample_table(
    drives: Sequence[Drive], oversampling: int, clock: ScanClock | None = None
) -> SampleTable:
    """The samples of a scan: drive by drive, channels ascending."""
    clock = clock or ScanClock()
    rows = [
        (number, channel, place)
        for number, drive in enumerate(drives)
        for place, channel in enumerate(
            c for c in range(drive.mask.bit_length()) if drive.mask >> c & 1
        )
    ]
    drive, channel, place = np.array(rows, dtype=np.int64).reshape(-1, 3).T
    each = (oversampling + clock.dropped) * clock.conversion
    length = clock.settling + np.bincount(drive, minlength=len(drives)) * each
    length = np.maximum(length, clock.on)
    switched = np.cumsum(clock.dead_time + length) - length
    since = clock.settling + place * each + clock.dropped * clock.conversion
    return SampleTable(
        drives=np.array([(d.source, d.sink) for d in drives], dtype=np.int64).reshape(-1, 2),
        drive=drive,
        channel=channel,
        oversampling=oversampling,
        since=np.asarray(since),
        time=np.asarray(switched[drive] + since),
        length=np.asarray(length),
        conversion=clock.conversion,
    )


def chopped_table(
    drives: Sequence[Drive], oversampling: int, clock: ScanClock, frequency: float, periods: int
) -> SampleTable:
    """The samples of an alternating scan: ``periods`` of each drive at ``frequency`` Hz.

    ``oversampling`` is shared between all directions of a drive.
    """
    directions = 2 * periods
    each = [
        Drive(drive.sink, drive.source, drive.mask) if number % 2 else drive
        for drive in drives
        for number in range(directions)
    ]
    clock = replace(clock, on=0.5 / frequency - clock.dead_time)
    return replace(sample_table(each, oversampling // directions, clock), directions=directions)


def table_of(scan: Scan, settings: ScanSettings) -> SampleTable:
    """The samples of a host's ``scan``, as the board would take them."""
    drives = [
        Drive(source, sink, mask)
        for (source, sink), mask in zip(scan.drives.tolist(), scan.masks.tolist(), strict=True)
    ]
    clock = ScanClock(settings.dead_time, settings.settling, settings.conversion)
    if not settings.chop_frequency:
        return sample_table(drives, settings.oversampling, clock)
    channels = int(np.bincount(scan.sample_drive).max())
    periods = choose_periods(LIMITS, settings, channels, TICK_RATE, "twin")
    return chopped_table(drives, settings.oversampling, clock, settings.chop_frequency, periods)
