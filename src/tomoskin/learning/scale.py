"""Whether numbers have the unit that they are taken to have: voltages against what was taught, and
labels against what a hand does.

A skin changes by a part of its own voltages when it is pressed, whatever it is made of. What is far
outside that is in another unit, in either direction.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from tomoskin.core import FloatArray
from tomoskin.learning.amount.measurand import Measurand
from tomoskin.learning.kind import Calibration

LEAST_CHANGE, MOST_CHANGE = 1e-4, 1.0
"""What presses change, part of the untouched voltages (root mean squares). Five public sets that
hold both have 2e-3 to 2e-2, so that a thousandth or a thousand times of any of them is outside."""

_APART = 100.0
"""Differences alone, without untouched voltages, are compared up to this factor: nothing else than
untouched frames are so much smaller than presses."""

_USUAL = {"force": (0.05, 15.0), "depth": (1e-4, 0.03)}
"""What most labels are between, SI: a finger or a weight, and the travel of a tip."""

_ELSE = {
    "force": ("are they grams? 1 N is the weight of 102 g", "are they kilograms?"),
    "depth": ("are they in another unit than that?", "are they in inches or centimetres?"),
}
"""What labels are where nearly all are larger, and smaller, than usual."""


def scale_doubt(
    calibration: Calibration[Any], change: FloatArray, untouched: NDArray[Any] | None
) -> str | None:
    """What speaks for another unit of frames than of those that a calibration was learnt from.

    ``change`` (n, n_meas) of frames from the untouched skin; ``untouched`` (n_meas,) what it reads,
    None where a file holds differences alone. None of a calibration that keeps no frames.
    """
    taught = _taught(calibration.model)
    if taught is None or not len(taught) or taught.shape[1] != change.shape[1]:
        return None
    own = float(np.median(_size(taught)))
    if untouched is None:
        most = float(np.nanmax(_size(change)))
        factor, apart = most / own if own > 0 else 1.0, _APART
        compared = "the largest change of these frames"
    else:
        part = own / float(_size(np.abs(untouched)[None])[0])
        factor = 1.0 if LEAST_CHANGE <= part <= MOST_CHANGE else 1 / part
        apart, compared = 1.0, "the untouched voltages of these frames"
    if not factor > 0 or 1 / apart <= factor <= apart:
        return None
    return (
        f"{compared} are {factor:.2g} times what presses of the calibration of "
        f"{calibration.kind.subject} have changed: one of them is in another unit, such as mV "
        "instead of V, and what is read means nothing"
    )


def label_unit_doubt(of: Measurand, amount: FloatArray) -> str | None:
    """What speaks for another unit of labels ``amount`` (n,), SI, than they are taken to be in."""
    known = amount[np.isfinite(amount)]
    if not len(known):
        return None
    least, most = _USUAL[of.name]
    middle = float(np.median(known))
    if least <= middle <= most:
        return None
    large, small = _ELSE[of.name]
    usual = f"{of.text(least)} to {of.text(most)}"
    return (
        f"the {of.plural} are taken as {of.span(known)}, but most presses have {usual}: "
        f"{large if middle > most else small} Name the unit with --unit"
    )


def _taught(model: Any) -> FloatArray | None:
    """(n, n_meas) frames that a model was learnt from, as presses or as examples."""
    for name in ("presses", "examples"):
        dv = getattr(getattr(model, name, None), "dv", None)
        if isinstance(dv, np.ndarray) and dv.ndim == 2:
            return dv
    return None


def _size(frames: NDArray[Any]) -> FloatArray:
    """(n,) root mean square of the finite values of each frame, 0 where there is none."""
    finite = np.isfinite(frames)
    squares = np.where(finite, np.abs(frames), 0.0) ** 2
    return np.asarray(np.sqrt(squares.sum(axis=1) / np.maximum(finite.sum(axis=1), 1)))
