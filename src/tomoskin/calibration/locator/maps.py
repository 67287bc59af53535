"""Response maps: what every row of the pattern answers to a press at every place."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Self

import numpy as np

from tomoskin.calibration.locator.coregion import Coregion, Projected
from tomoskin.calibration.locator.kernel import Basis, Likeness
from tomoskin.core import FloatArray

_ROUNDING = 1e-9


@dataclass(frozen=True, eq=False)
class ResponseMaps:
    """A matrix-variate Gaussian process from place to features.

    Cov(features) = likeness ⊗ A + 1 ⊗ S: the rows' maps are alike where A says so, and their
    noise is correlated by S.
    """

    mean: FloatArray
    basis: Basis
    data: Projected
    axes: FloatArray
    coregion: Coregion

    @classmethod
    def of(
        cls,
        likeness: Likeness,
        places: FloatArray,
        features: FloatArray,
        coregion: Coregion | None = None,
    ) -> Self:
        """Maps for ``features`` (n, k) of presses at ``places`` (n, 2).

        How the rows answer together is learnt, unless ``coregion`` knows it.
        """
        mean = features.mean(axis=0)
        centred = features - mean
        basis = Basis.of(likeness, places)
        values = basis(places)
        weights, axes = np.linalg.eigh(values.T @ values)
        keep = weights > _ROUNDING * weights[-1]
        weights, axes = weights[keep], axes[:, keep]
        rows = (axes / np.sqrt(weights)).T @ (values.T @ centred)
        n_rest = len(places) - len(weights)
        rest = centred.T @ centred - rows.T @ rows if n_rest else np.zeros(2 * (len(mean),))
        data = Projected(weights, rows, rest, n_rest)
        return cls(mean, basis, data, axes, coregion or Coregion.of(data))

    @property
    def evidence(self) -> float:
        """Log marginal likelihood, up to a constant of the features."""
        return self.coregion.evidence

    def whitened(self, features: FloatArray) -> FloatArray:
        """(n, k) coordinates in which the noise is independent with variance 1."""
        return np.asarray((features - self.mean) @ self.coregion.whiten)

    def at(self, places: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Mean and variance, both (n, k), of the whitened features of a press at ``places``."""
        at = self.basis(places) @ self.axes
        mean_of, variance_of = self._solved
        gain = self.coregion.gain
        left = self.basis.likeness.variance * gain - (at**2) @ variance_of
        return at @ mean_of, 1.0 + np.maximum(left, 0.0)

    def features_at(self, places: FloatArray) -> FloatArray:
        """(n, k) features that are expected of presses at ``places`` (n, 2)."""
        return np.asarray(self.at(places)[0] @ self._unwhiten + self.mean)

    @cached_property
    def _unwhiten(self) -> FloatArray:
        return np.asarray(np.linalg.inv(self.coregion.whiten))

    @cached_property
    def _solved(self) -> tuple[FloatArray, FloatArray]:
        """What takes a basis function to the mean, and its square to the known variance."""
        weights, gain = self.data.weights[:, None], self.coregion.gain
        known = gain / (1 + weights * gain)
        rows = self.data.rows @ self.coregion.whiten
        return np.sqrt(weights) * known * rows, weights * gain * known
