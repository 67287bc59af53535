"""What a scan samples, and when."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from tomoskin.core import FloatArray, IntArray
from tomoskin.pattern import Scan
from tomoskin.source import ScanSettings
from tomoskin.wire import Drive


@dataclass(frozen=True, slots=True)
class ScanClock:
    """Times of a scan, s: all off between two drives, wait after each switch, one conversion."""

    dead_time: float = 0.0
    settling: float = 0.0
    conversion: float = 0.0


@dataclass(frozen=True, eq=False)
class SampleTable:
    """The samples of a scan, in order; electrodes from 0.

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
    """

    drives: IntArray
    drive: IntArray
    channel: IntArray
    oversampling: int
    since: FloatArray
    time: FloatArray
    length: FloatArray
    conversion: float

    @property
    def source(self) -> IntArray:
        """(n_samples,)."""
        return np.asarray(self.drives[self.drive, 0])

    @property
    def sink(self) -> IntArray:
        """(n_samples,)."""
        return np.asarray(self.drives[self.drive, 1])

    @property
    def middles(self) -> FloatArray:
        """(n_drives,) s from the start of the scan to the middle of each drive."""
        dead = self._dead / max(len(self.drives), 1)
        return np.asarray(np.cumsum(self.length + dead) - self.length / 2)

    @property
    def seconds(self) -> float:
        """How long one scan takes."""
        return float(self.length.sum()) + self._dead

    @property
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
    each = oversampling * clock.conversion
    length = clock.settling + np.bincount(drive, minlength=len(drives)) * each
    switched = np.cumsum(clock.dead_time + length) - length
    since = clock.settling + place * each
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


def table_of(scan: Scan, settings: ScanSettings) -> SampleTable:
    """The samples of a host's ``scan``, as the board would take them."""
    drives = [
        Drive(source, sink, mask)
        for (source, sink), mask in zip(scan.drives.tolist(), scan.masks.tolist(), strict=True)
    ]
    clock = ScanClock(settings.dead_time, settings.settling, settings.conversion)
    return sample_table(drives, settings.oversampling, clock)
