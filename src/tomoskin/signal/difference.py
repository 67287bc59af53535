"""Difference data: what the linear operators are fed with."""

from __future__ import annotations

import numpy as np

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
        When shapes differ, the kind is not known, or a reference of zero would divide.
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
            "the reference is zero, so its difference cannot be normalised",
            where=f"row {int(np.argmin(reference != 0))}",
            hint='set difference = "plain" in [inverse], or look at that electrode',
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
