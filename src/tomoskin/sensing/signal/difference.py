"""Difference data: what the linear operators are fed with; between frames, and in phase."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from tomoskin.core import DataError, FloatArray

DIFFERENCES = ("plain", "normalised")


def difference(values: FloatArray, reference: FloatArray, kind: str) -> FloatArray:
    """Change of the voltages against the reference.

    Parameters
    ----------
    values
        (…, n_meas) V.
    reference
        (n_meas,) V.
    kind
        "plain": v − v_ref, V; "normalised": (v − v_ref) / |v_ref|, a ratio.

    Raises
    ------
    DataError
        When shapes differ, the kind is unknown, or a reference of zero would divide.
    """
    if kind not in DIFFERENCES:
        raise DataError(f'expected a difference among {", ".join(DIFFERENCES)}, got "{kind}"')
    if values.shape[-1:] != reference.shape:
        raise DataError(f"expected {len(reference)} voltages, got {values.shape[-1]}")
    change = values - reference
    if kind == "plain":
        return np.asarray(change)
    if not reference.all():
        raise DataError(
            "the reference is zero, so the difference cannot be normalised by it",
            where=f"row {int(np.argmin(reference != 0))}",
            hint='set difference = "plain" in [inverse], or check that electrode',
        )
    return np.asarray(change / np.abs(reference))


def undone(change: FloatArray, reference: FloatArray, kind: str) -> FloatArray:
    """(…, n_meas) V: the voltages of which ``change`` is the :func:`difference`."""
    return np.asarray(reference + (change if kind == "plain" else change * np.abs(reference)))


def difference_noise(noise: FloatArray, reference: FloatArray, kind: str) -> FloatArray:
    """Standard deviation of difference data, (n_meas,), where that of the voltages is ``noise``.

    ``noise`` and ``reference`` are (n_meas,) V; the result is V, or a ratio when normalised.
    """
    return noise if kind == "plain" else np.asarray(noise / np.abs(reference))


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
            raise DataError(
                f"expected finite voltages, but rows {np.flatnonzero(~finite)} are not finite"
            )
        change = None if self._last is None else difference(values, self._last, self.kind)
        self._last = np.array(values)
        return change


def in_phase(
    values: NDArray[Any], reference: NDArray[Any], model: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Rotate by the instrument's phase and keep the real part.

    The phase is one for all rows: that of Σ model · reference, so that each row keeps its sign.

    Parameters
    ----------
    values, reference
        (n_frames, n_meas) and (n_meas,), complex or real (then they pass unchanged).
    model
        (n_meas,) V, what a real model expects of the reference.
    """
    if not (np.iscomplexobj(values) or np.iscomplexobj(reference)):
        return values, reference
    phase = np.exp(-1j * np.angle(np.nansum(model * reference)))
    return (values * phase).real, (reference * phase).real
