"""The scan: what a board samples so that every row of a pattern can be formed from it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

from tomoskin.core import IntArray, PatternError
from tomoskin.model.pattern.pattern import Pattern

_MOST = 32
"""Electrodes that a mask has bits for."""


@dataclass(frozen=True, eq=False)
class Scan:
    """Per drive, the electrodes whose potential is sampled, in ascending order.

    A frame's samples are drive-major: all electrodes of drive 0, then of drive 1, and so on.

    Attributes
    ----------
    drives
        (n_drive, 2) source, sink.
    masks
        (n_drive,) bit e set where electrode e is sampled under that drive.
    sample_drive, sample_electrode
        (n_samples,) drive and electrode of each sample.
    plus, minus
        (n_meas,) sample that each row of the pattern adds, and the one it subtracts.
    """

    drives: IntArray
    masks: NDArray[np.uint32]
    sample_drive: IntArray
    sample_electrode: IntArray
    plus: IntArray
    minus: IntArray

    @classmethod
    def of(cls, pattern: Pattern) -> Self:
        """Smallest scan that holds every row of ``pattern``.

        Raises PatternError when there are more electrodes than a mask has bits, or a drive is a
        current into many of them.
        """
        if pattern.spread:
            raise PatternError("a board drives a pair at a time, not several electrodes")
        n = pattern.n_electrodes
        if n > _MOST:
            raise PatternError(f"expected at most {_MOST} electrodes to scan, got {n}")
        read = np.zeros((pattern.n_drive, n), dtype=bool)
        read[pattern.drive_index[:, None], pattern.measure] = True
        sample_drive, sample_electrode = np.nonzero(read)
        number = np.full(read.shape, -1)
        number[read] = np.arange(len(sample_drive))
        masks = (read * (np.uint32(1) << np.arange(n, dtype=np.uint32))).sum(axis=1)
        return cls(
            drives=pattern.drives,
            masks=masks.astype(np.uint32),
            sample_drive=sample_drive,
            sample_electrode=sample_electrode,
            plus=number[pattern.drive_index, pattern.measure[:, 0]],
            minus=number[pattern.drive_index, pattern.measure[:, 1]],
        )

    @property
    def n_samples(self) -> int:
        """Number of samples in a frame."""
        return len(self.sample_drive)
