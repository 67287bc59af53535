"""Positions of touches on a sheet that answers as its model says."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Self

import numpy as np

from tomoskin.core import FloatArray
from tomoskin.learning.touch.process import squared_distances
from tomoskin.model.forward import ForwardModel

_WIDTH = 0.1
"""Deviation, in radii, of a touch on the sheet."""

_FREEDOM = 8.0
"""Independent values in a frame: what the model leaves errs together."""

_HOLDS = 0.5
"""Part of a usual frame that the model must explain: 0.75 to 0.9 on the twin, at most 0.24 on the
public hydrogels."""

_LEAST = 1e-99


def model_responses(
    model: ForwardModel, conductivity: float, positions: FloatArray, unit: float
) -> FloatArray:
    """(g, n_meas) change of each row by a touch at ``positions`` (g, 2) m, in any one unit.

    ``unit`` m: radius of the skin.
    """
    off = squared_distances(positions, model.mesh.centroids[:, :2])
    touched = np.exp(-0.5 * off / (_WIDTH * unit) ** 2) * model.mesh.volumes
    return np.asarray(touched @ model.jacobian(conductivity).T)


@dataclass(frozen=True, eq=False)
class ModelFit:
    """Frames against the model's responses.

    Attributes
    ----------
    weights
        (n, g) probabilities of the grid's positions. Touches may be anywhere, as often as it be.
    explained
        Part of a usual frame's square that the likeliest response explains (median).
    """

    weights: FloatArray
    explained: float

    @classmethod
    def of(cls, dv: FloatArray, responses: FloatArray) -> Self:
        """Compare shapes: how hard a touch is, and whether changes rise or fall, is not known.

        ``dv`` (n, k), ``responses`` (g, k). Channels' gains are one, or those that make a usual
        change as large as the model's: whatever explains more.
        """
        dv = np.nan_to_num(dv)
        usual = _usual(dv) / _usual(responses)
        scales = (np.ones(len(usual)), np.maximum(usual, _LEAST))
        fits = [cls._of(sign * dv / scale, responses) for scale in scales for sign in (1, -1)]
        return max(fits, key=lambda fit: fit.explained)

    @classmethod
    def _of(cls, dv: FloatArray, responses: FloatArray) -> Self:
        shapes, expected = _shapes(dv), _shapes(responses)
        best = (shapes @ expected.T).max(axis=1)
        off = squared_distances(shapes, expected)
        noise = float(off.min(axis=1).mean()) / _FREEDOM
        weights = np.exp(-0.5 * (off - off.min(axis=1, keepdims=True)) / noise)
        explained = float(np.median(np.maximum(best, 0.0) ** 2))
        return cls(weights / weights.sum(axis=1, keepdims=True), explained)

    @property
    def holds(self) -> bool:
        """Whether the sheet answers as the model says."""
        return self.explained > _HOLDS


def _shapes(values: FloatArray) -> FloatArray:
    size = np.linalg.norm(values, axis=1, keepdims=True)
    return np.asarray(values / np.maximum(size, _LEAST))


def _usual(values: FloatArray) -> FloatArray:
    return np.asarray(np.maximum(np.median(np.abs(values), axis=0), _LEAST))
