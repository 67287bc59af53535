"""Difference data and labels of a recording, as the locator wants them."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from tomoskin.cli.recording import idle_frames
from tomoskin.core import DataError, FloatArray, IntArray

if TYPE_CHECKING:
    from tomoskin.pattern import Pattern
    from tomoskin.signal import Recording


def changes(recording: Recording, reference: str | None, pattern: Pattern) -> FloatArray:
    """(n, n_meas) frames minus the untouched skin.

    Raises
    ------
    DataError
        For complex data, or a reference that is no untouched skin.
    """
    idle = idle_frames(recording, reference, pattern)
    if isinstance(idle, str):
        raise DataError("expected untouched frames", where="--reference", hint="first:N or a file")
    values = recording.voltages if idle is None else recording.voltages - idle.mean(axis=0)
    if np.iscomplexobj(values):
        raise DataError(
            "holds complex voltages", where=recording.source, hint="calibrate on their magnitudes"
        )
    return np.asarray(values, dtype=np.float64)


def labelled_frames(places: FloatArray) -> IntArray:
    """(k,) frames of ``places`` (n, 2) that have a label."""
    return np.flatnonzero(np.isfinite(places).all(axis=1))


def labels(recording: Recording) -> FloatArray:
    """(n, 2) m, NaN where a frame has no label. Raises DataError where there is none at all."""
    if recording.labels is None or not np.isfinite(recording.labels).all(axis=1).any():
        raise DataError(
            "holds no labels: expected xy_m (n_frames, 2), the place of each press",
            where=recording.source,
            hint="docs/touch.md says how to make them",
        )
    return recording.labels
