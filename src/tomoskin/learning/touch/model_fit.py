"""Frames of one touch each beside what the skin's model says of touches everywhere."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Self

import numpy as np

from tomoskin.core import FloatArray
from tomoskin.learning.touch.gaussian_process import squared_distances
from tomoskin.model.forward import ForwardModel
from tomoskin.model.pattern import Pattern
from tomoskin.model.skin import Skin
from tomoskin.sensing.segment import Region

_WIDTH = 0.1
"""Deviation, in radii, of a touch on the sheet."""

_MODEL_FREEDOM = 8.0
"""Independent values in a frame: what the model leaves errs together."""

_HOLDS = 0.5
"""Part of a usual frame that the model must explain: 0.76 to 0.95 on the twin, at most 0.24 on the
public hydrogels."""

_NOISIEST, _TELLING = 0.5, 150
_TINY = 1e-99


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
        Part of a usual frame's square, less what is noise, that the likeliest response explains
        (median).
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
        scales = (np.ones(len(usual)), np.maximum(usual, _TINY))
        fits = []
        for data in (dv / scale for scale in scales):
            noise = _noise_part(data)
            fits += [cls._of(sign * data, responses, noise) for sign in (1, -1)]
        return max(fits, key=lambda fit: fit.explained)

    @classmethod
    def _of(cls, dv: FloatArray, responses: FloatArray, noise_part: float) -> Self:
        shapes, expected = _shapes(dv), _shapes(responses)
        best = (shapes @ expected.T).max(axis=1)
        off = squared_distances(shapes, expected)
        noise = float(off.min(axis=1).mean()) / _MODEL_FREEDOM
        weights = np.exp(-0.5 * (off - off.min(axis=1, keepdims=True)) / noise)
        usual = float(np.median(np.maximum(best, 0.0) ** 2))
        explained = min(usual / (1 - noise_part), 1.0)
        return cls(weights / weights.sum(axis=1, keepdims=True), explained)

    @property
    def holds(self) -> bool:
        """Whether the sheet answers as the model says."""
        return self.explained > _HOLDS


def compared(
    dv: FloatArray, skin: Skin, pattern: Pattern, region: Region
) -> tuple[ForwardModel, ModelFit]:
    """The skin's model, and frames ``dv`` (n, n_meas) against it on the grid of the region."""
    model = ForwardModel(skin.mesh(), pattern, contact_impedance=skin.contact_impedance)
    places = region.metres(region.grid)
    return model, ModelFit.of(dv, model_responses(model, skin.conductivity, places, region.unit))


def _noise_part(dv: FloatArray) -> float:
    """Part of a usual frame's square that is noise, in frames (n, k) of one touch each.

    Touches change the data in few directions, so that along the median one there is noise alone.
    More than half is taken for half: noise by itself is not to look like a touch. Few frames do not
    tell it.
    """
    if len(dv) < _TELLING:
        return 0.0
    along = np.linalg.svd(dv, compute_uv=False) ** 2 / len(dv)
    part = np.median(along) * len(along) / max(np.median(np.sum(dv**2, axis=1)), _TINY)
    return min(float(part), _NOISIEST)


def _shapes(values: FloatArray) -> FloatArray:
    size = np.linalg.norm(values, axis=1, keepdims=True)
    return np.asarray(values / np.maximum(size, _TINY))


def _usual(values: FloatArray) -> FloatArray:
    return np.asarray(np.maximum(np.median(np.abs(values), axis=0), _TINY))
