"""The rule of labelled presses: the alpha that finds them where they were."""

from __future__ import annotations

import numpy as np

from tomoskin.core import DataError, FloatArray, IntArray
from tomoskin.inverse.choice import AlphaChoice, Curve, Evidence, Locate
from tomoskin.inverse.spectrum import Spectrum

FOLDS = 5
_PER_DECADE = 8
_MISSED = 0.25
"""A press that is not found counts as this part of the mesh's largest extent."""


def labelled(spectrum: Spectrum, evidence: Evidence) -> AlphaChoice:
    """Least mean distance between presses and the touches found, in log alpha averaged over folds.

    In each of five folds alpha is chosen without the fold's presses, and the error stated is
    that on them. Needs frames, their places and a function that finds touches in an image.
    """
    frames, places = evidence.labelled(len(spectrum.values))
    if evidence.locate is None:
        raise DataError("nothing says how touches are found in an image", where="rule labelled")
    alphas = spectrum.alphas[:: _step(spectrum)]
    errors = np.array([_errors(spectrum, a, frames, places, evidence.locate) for a in alphas])
    chosen, held_out = _folded(errors)
    alpha = float(np.exp(np.log(alphas[chosen]).mean()))
    at = int(np.abs(np.log(alphas / alpha)).argmin())
    reason = (
        f"{len(frames)} labelled presses are found to {1e3 * held_out:.1f} mm on average, "
        "each by an alpha chosen without it"
    )
    curve = Curve(alphas, 1e3 * errors.mean(axis=1), "alpha", "mean position error, mm", at)
    return AlphaChoice(alpha, "labelled", reason, curve)


def _step(spectrum: Spectrum) -> int:
    alphas = spectrum.alphas
    decades = float(np.log10(alphas[-1] / alphas[0]))
    return max(round(len(alphas) / (decades * _PER_DECADE)), 1)


def _errors(
    spectrum: Spectrum, alpha: float, frames: FloatArray, places: FloatArray, locate: Locate
) -> FloatArray:
    """(n,) m: distance of each press to the nearest touch; more touches than one cost as well."""
    images = (spectrum.coefficients(frames) * spectrum.gains(alpha)) @ spectrum.modes.T
    missed = _MISSED * float(np.ptp(spectrum.problem.model.mesh.points, axis=0).max())
    return np.array(
        [_error(locate(x), place, missed) for x, place in zip(images, places, strict=True)]
    )


def _error(found: FloatArray, place: FloatArray, missed: float) -> float:
    if not len(found):
        return missed
    nearest = float(np.linalg.norm(found - place, axis=1).min())
    return (min(nearest, missed) + missed * (len(found) - 1)) / len(found)


def _folded(errors: FloatArray) -> tuple[IntArray, float]:
    """Index chosen in each fold, and the mean error of presses that were left out of it."""
    n = errors.shape[1]
    fold = np.arange(n) % min(FOLDS, n)
    chosen, left_out = [], np.empty(n)
    for k in range(int(fold.max()) + 1):
        best = int(errors[:, fold != k].mean(axis=1).argmin())
        left_out[fold == k] = errors[best, fold == k]
        chosen.append(best)
    return np.array(chosen), float(left_out.mean())
