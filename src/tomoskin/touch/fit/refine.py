"""The most likely spots near a start, and their covariance: Levenberg–Marquardt."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Self

import numpy as np
from scipy.linalg import cho_factor, cho_solve
from scipy.spatial import cKDTree

from tomoskin.core import FloatArray
from tomoskin.mesh import Mesh
from tomoskin.touch.fit.noise import Whitener
from tomoskin.touch.fit.prior import SpotPrior
from tomoskin.touch.fit.spot import CONTENT, N_PARAMETERS, Response, X, Y

_SETTLED = 0.02
"""Newton decrement, squared, at which a step is too small to matter: 0.14 deviations."""

_LEAST_DAMPING = 1e-6


_DIRECTED = 0.7
"""Standard deviation of a spot's direction (:class:`Part`) about none."""

_RESHAPED = 0.5
"""Standard deviation of its shape, of the way from a tail to a bell: both are one from ours."""


@dataclass(frozen=True, eq=False)
class Weigh:
    """Unknown amplitudes along some directions D, marginalised (integrated out).

    Data then have the covariance 1 + DDᵀ; the inverse of its root is 1 − U(1 − 1/√(1 + s²))Uᵀ
    with the singular vectors U and values s of D.
    """

    vectors: FloatArray
    less: FloatArray
    log_size: float

    @classmethod
    def of(cls, directions: FloatArray) -> Self:
        """Of (r, k) directions, each as long as its amplitude's deviation."""
        vectors, sizes, _ = np.linalg.svd(directions, full_matrices=False)
        return cls(vectors, 1 - 1 / np.sqrt(1 + sizes**2), float(np.log1p(sizes**2).sum() / 2))

    def __call__(self, whitened: FloatArray) -> FloatArray:
        """(r, …) data, weighed."""
        part = self.vectors.T @ whitened
        part = self.less * part if part.ndim == 1 else self.less[:, None] * part
        return np.asarray(whitened - self.vectors @ part)


@dataclass(frozen=True, eq=False)
class Fit:
    """Spots that explain a frame.

    Attributes
    ----------
    spots
        (k, 4), see :mod:`tomoskin.touch.fit.spot`.
    predicted
        (r,) what the spots do to the whitened data.
    residual
        (r,) whitened data less that, weighed for unknown directions.
    jacobian
        (r, 4k) of the whitened model, weighed in the same way.
    weigh
        What does that.
    normal
        (4k, 4k) inverse of the covariance: JᵀJ and the prior.
    cost
        Half the squares of residual and prior.
    settled
        Whether the steps towards it came to an end.
    """

    spots: FloatArray
    predicted: FloatArray
    residual: FloatArray
    jacobian: FloatArray
    weigh: Weigh
    normal: FloatArray
    cost: float
    settled: bool = True

    @cached_property
    def covariance(self) -> FloatArray:
        """(4k, 4k) of all parameters, by the curvature at the minimum."""
        scale = 1 / np.sqrt(np.diag(self.normal))
        even = np.linalg.inv(self.normal * scale[:, None] * scale)
        return np.asarray(even * scale[:, None] * scale)

    @property
    def degrees(self) -> int:
        """Degrees of freedom of the residual."""
        return max(len(self.residual) - len(self.normal), 1)

    @cached_property
    def misfit(self) -> float:
        """Squares of the residual: about as many as it has entries where the model is right."""
        return float(self.residual @ self.residual)

    def log_evidence(self, prior: SpotPrior) -> float:
        """Logarithm of ∫ likelihood · prior by Laplace's method (MacKay 2003, eq. 28.5).

        Up to what all fits of the same data have in common.
        """
        n = len(self.normal)
        sign, log_det = np.linalg.slogdet(self.normal) if n else (1.0, 0.0)
        volume = (n * math.log(2 * math.pi) - log_det) / 2 if sign > 0 else -np.inf
        likelihood = -self.misfit / 2 - self.weigh.log_size
        return likelihood + prior.log_density(self.spots) + volume


@dataclass(frozen=True, eq=False)
class Problem:
    """Whitened data (r,) of one frame, and what they are explained with.

    ``sign`` is "decrease", "increase" or "both". Standard deviations of what a touch does within a
    scan: its way along each axis, ``reach`` m, and what it ``grows`` by, in parts of it.
    """

    response: Response
    whiten: Whitener
    prior: SpotPrior
    sheet: SheetDomain
    sign: str
    reach: float
    grows: float
    data: FloatArray

    def nothing(self) -> Fit:
        """The frame with no spot at all."""
        none = np.zeros((0, N_PARAMETERS))
        slopes = np.zeros((len(self.data), 0))
        cost = float(self.data @ self.data) / 2
        weigh = Weigh.of(slopes)
        return Fit(none, 0 * self.data, self.data, slopes, weigh, np.zeros((0, 0)), cost)

    def at(self, spots: FloatArray) -> Fit:
        """The frame with these spots, as they are."""
        change, jacobian, nuisances = self.response.expanded(spots)
        amplitudes = np.tile((_DIRECTED, _RESHAPED), len(spots))
        unknown = np.hstack([amplitudes * nuisances, self._within_scan(spots, jacobian)])
        predicted, weigh = self.whiten(change), Weigh.of(self.whiten(unknown.T).T)
        residual, slope = weigh(self.data - predicted), weigh(self.whiten(jacobian.T).T)
        away, weights = self.prior.away(spots), np.tile(self.prior.weights, len(spots))
        normal = slope.T @ slope + np.diag(weights**2)
        cost = (residual @ residual + float((away**2).sum())) / 2
        return Fit(spots, predicted, residual, slope, weigh, normal, float(cost))

    def _within_scan(self, spots: FloatArray, jacobian: FloatArray) -> FloatArray:
        """(n_meas, 3k) V: what it does that touches move along x and y, and grow, while the rows
        are read one after the other."""
        if not self.reach:
            return np.zeros((len(jacobian), 0))
        early = self.response.times[:, None]
        moves = early * jacobian * self.reach
        grows = early * jacobian[:, CONTENT::N_PARAMETERS] * (self.grows * spots[:, CONTENT])
        return np.hstack([moves[:, X::N_PARAMETERS], moves[:, Y::N_PARAMETERS], grows])

    def refined(self, spots: FloatArray, most: int) -> Fit:
        """The minimum of the cost near ``spots`` (k, 4), after at most so many steps."""
        return self.settled(self.at(self._allowed(spots)), most)

    def settled(self, best: Fit, most: int) -> Fit:
        """The minimum of the cost near ``best``, after at most so many steps.

        Levenberg (1944) and Marquardt (1963): damping relative to the diagonal.
        """
        damping = _LEAST_DAMPING
        for _ in range(most):
            gradient = self._gradient(best)
            step = _solved(best.normal, gradient, damping)
            if gradient @ step < _SETTLED:
                return replace(best, settled=True)
            tried = self.at(self._allowed(best.spots + step.reshape(-1, N_PARAMETERS)))
            if tried.cost < best.cost:
                best, damping = tried, max(damping / 10, _LEAST_DAMPING)
            elif damping > 1e3:
                return replace(best, settled=True)
            else:
                damping = max(damping * 30, 1e-2)
        return replace(best, settled=False)

    def _gradient(self, fit: Fit) -> FloatArray:
        pull = self.prior.away(fit.spots) * self.prior.weights
        return np.asarray(fit.jacobian.T @ fit.residual - pull.ravel())

    def _allowed(self, spots: FloatArray) -> FloatArray:
        return self.prior.held(self.sheet.held(spots), self.sign)


class SheetDomain:
    """Where a touch may be: what leaves the mesh is brought back to its nearest cell."""

    def __init__(self, mesh: Mesh) -> None:
        self._centroids = mesh.centroids
        self._tree = cKDTree(mesh.centroids)
        corners = mesh.points[mesh.cells] - mesh.centroids[:, None]
        self._margin = np.linalg.norm(corners, axis=2).max(axis=1)

    def held(self, spots: FloatArray) -> FloatArray:
        """``spots`` (k, 4) on the sheet."""
        apart, cell = (np.atleast_1d(nearest) for nearest in self._tree.query(spots[:, :2]))
        off = np.asarray(apart > self._margin[cell])
        if not off.any():
            return spots
        kept = spots.copy()
        kept[off, :2] = self._centroids[cell[off]]
        return kept


def _solved(normal: FloatArray, gradient: FloatArray, damping: float) -> FloatArray:
    scale = 1 / np.sqrt(np.diag(normal))
    even = normal * scale[:, None] * scale
    even[np.diag_indices_from(even)] *= 1 + damping
    return np.asarray(scale * cho_solve(cho_factor(even), scale * gradient))
