"""What electrodes show that does not turn with the current: the sums of an alternating drive.

The two directions of a drive add up to what is common to its channels plus twice what each channel
has by itself: a thermoelectric or half-cell voltage, an offset of its amplifier. A table of drives
and electrodes of which each entry is the sum of two unknowns is solved by least squares.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

from tomoskin.core import FloatArray
from tomoskin.model.pattern import Scan

_LARGE = 0.05
"""Part of the converter's range above which an electrode's own voltage is worth a word: so much of
the range is lost to it."""


@dataclass(frozen=True, eq=False)
class OwnVoltage:
    """Own voltages of a scan's electrodes.

    Attributes
    ----------
    matrix
        (n_electrodes, n_samples) V per count of the sums; the mean over the electrodes is 0.
    large
        V above which one is worth a word.
    """

    matrix: FloatArray
    large: float

    @classmethod
    def of(cls, scan: Scan, volts_per_count: float, full: float) -> Self:
        """Of a read-out whose range has ``full`` counts."""
        n_drives, n = len(scan.drives), int(scan.sample_electrode.max(initial=-1)) + 1
        by_drive = scan.sample_drive[:, None] == np.arange(n_drives)
        by_electrode = scan.sample_electrode[:, None] == np.arange(n)
        design = np.hstack([by_drive, by_electrode]).astype(np.float64)
        matrix = np.linalg.pinv(design)[n_drives:] * volts_per_count
        return cls(matrix - matrix.mean(axis=0), _LARGE * full * volts_per_count)

    def __call__(self, sums: NDArray[np.uint16]) -> FloatArray:
        """(n_electrodes,) V against their mean, of the (n_samples,) sums of a frame."""
        return np.asarray(self.matrix @ sums.astype(np.float64))
