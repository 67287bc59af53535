"""Dynamic imaging, the source's fourth class: each frame against the one before it."""

from __future__ import annotations

import numpy as np

from tomoskin.core import DataError, FloatArray, IntArray
from tomoskin.signal.difference import DIFFERENCES, difference


class Consecutive:
    """Differences between consecutive frames, for fast changes; no reference is needed.

    ``kind`` is "plain" or "normalised" (by the frame before). Raises DataError for another one.
    """

    def __init__(self, kind: str = "plain") -> None:
        if kind not in DIFFERENCES:
            raise DataError(f'expected a difference among {", ".join(DIFFERENCES)}, got "{kind}"')
        self.kind = kind
        self._last: FloatArray | None = None

    def push(self, values: FloatArray) -> FloatArray | None:
        """(n_meas,) change since the last frame of ``values`` (n_meas,) V; None for the first.

        Raises
        ------
        DataError
            As :func:`difference`, or when a value is not finite; the last frame then stays.
        """
        finite = np.isfinite(values)
        if not finite.all():
            raise DataError(f"expected finite voltages; rows {np.flatnonzero(~finite)} are not")
        change = None if self._last is None else difference(values, self._last, self.kind)
        self._last = np.array(values)
        return change


def at_one_time(previous: FloatArray, current: FloatArray, drive_index: IntArray) -> FloatArray:
    """Rows of a scan as they would have been read together, when its first drive was.

    Drives follow each other while the sheet moves; each row is interpolated linearly between
    the two scans (Yerworth & Bayford 2013).

    Parameters
    ----------
    previous, current
        (n_meas,) V of two consecutive scans.
    drive_index
        (n_meas,) drive of each row, ``Pattern.drive_index``.

    Raises
    ------
    DataError
        When the shapes differ.
    """
    if not previous.shape == current.shape == drive_index.shape:
        raise DataError(
            f"expected two scans of {drive_index.shape}, got {previous.shape} and {current.shape}"
        )
    late = drive_index / (drive_index.max() + 1)
    return np.asarray(current - late * (current - previous))
