"""Rows that a whole recording lacks."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from tomoskin.core import DataError, IntArray
from tomoskin.inverse import MOST_EXCLUDED
from tomoskin.pattern import Pattern

_LISTED = 5


def dead_rows(
    values: NDArray[Any], idle: NDArray[Any] | None, pattern: Pattern, source: str
) -> IntArray:
    """(k,) rows that are not finite in most frames, or in most of the idle ones.

    Parameters
    ----------
    values, idle
        (n_frames, n_meas) and (n_idle, n_meas) in the order of ``pattern``, or None.
    source
        Where they came from, for messages.

    Raises
    ------
    DataError
        When so few rows are left that the picture would be mostly prior.
    """
    parts = [values] if idle is None else [values, idle]
    dead = [(~np.isfinite(part)).mean(axis=0) > 0.5 for part in parts]
    rows = np.flatnonzero(np.any(dead, axis=0))
    if len(rows) == pattern.n_meas:
        raise DataError("no frame has finite values", where=source)
    if len(rows) > MOST_EXCLUDED * pattern.n_meas:
        listed = "; ".join(pattern.row_text(row) for row in rows[:_LISTED])
        raise DataError(
            f"{len(rows)} of {pattern.n_meas} rows hold no finite values, too many to leave out: "
            f"{listed}; …",
            where=source,
        )
    return rows
