"""Spots that explain a frame, and what the table of responses lacks of them."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from tomoskin.core import FloatArray
from tomoskin.sensing.fit.expectation import Expectation, Known
from tomoskin.sensing.fit.prior import SpotPrior
from tomoskin.sensing.fit.spot import N_PARAMETERS


@dataclass(frozen=True, eq=False)
class Deficit:
    """What a table lacks, as the exact model has it: a small part that changes slowly.

    Attributes
    ----------
    spots
        (k, 4) for which the exact model was solved.
    change
        (rank,) V by which it differs from the table, in the table's basis.
    """

    spots: FloatArray
    change: FloatArray

    @classmethod
    def none(cls, rank: int) -> Deficit:
        """Before the exact model is solved."""
        return cls(np.zeros((0, N_PARAMETERS)), np.zeros(rank))

    def holds_for(self, spots: FloatArray, part: float) -> bool:
        """Whether as many ``spots`` (k, 4) are where they were, as wide and as strong, but for a
        ``part`` of radius and content."""
        if len(spots) != len(self.spots):
            return False
        pairs = zip(spots.tolist(), self.spots.tolist(), strict=True)
        return all(
            math.hypot(x - at_x, y - at_y) <= part * math.exp(log_radius)
            and abs(new_log_radius - log_radius) <= part
            and abs(new_content - content) <= part * abs(content)
            for (x, y, new_log_radius, new_content), (at_x, at_y, log_radius, content) in pairs
        )


@dataclass(frozen=True, eq=False)
class Fit:
    """Spots that explain a frame. Unknown amplitudes along some directions are integrated out.

    Attributes
    ----------
    spots
        (k, 4), see :mod:`tomoskin.sensing.fit.spot`.
    deficit
        What the table lacks of these spots.
    change
        (rank,) V that all of them change by the table, in its basis.
    each, predicted
        (k, c) what each spot does to the whitened data, and (c,) what all do together.
    residual
        (c,) whitened data less what all do.
    slopes
        (4k, c) derivatives of the whitened model.
    unknown
        (q, c) directions, each as long as its amplitude's deviation.
    normal
        (4k, 4k) inverse of the covariance: JC⁻¹Jᵀ and the prior; C = 1 + unknownᵀ unknown.
    gradient
        (4k,) JC⁻¹ residual.
    misfit
        residualᵀ C⁻¹ residual: about as many as it has entries where the model is right.
    log_size
        Half the logarithm of the determinant of C.
    cost
        Half the misfit and the squares of the prior.
    degrees
        Degrees of freedom of the residual.
    settled
        Whether the steps towards it came to an end.
    known
        Who each spot is; nobody at all: all are newcomers.
    """

    spots: FloatArray
    deficit: Deficit
    change: FloatArray
    each: FloatArray
    predicted: FloatArray
    residual: FloatArray
    slopes: FloatArray
    unknown: FloatArray
    normal: FloatArray
    gradient: FloatArray
    misfit: float
    log_size: float
    cost: float
    degrees: int
    settled: bool = True
    known: Known = ()

    @cached_property
    def covariance(self) -> FloatArray:
        """(4k, 4k) of all parameters, by the curvature at the minimum."""
        scale = 1 / np.sqrt(np.diag(self.normal))
        even = np.linalg.inv(self.normal * scale[:, None] * scale)
        return np.asarray(even * scale[:, None] * scale)

    @property
    def beyond(self) -> float:
        """Squares of the residual beyond what noise has."""
        return self.misfit - self.degrees

    def log_evidence(self, prior: SpotPrior, expected: Expectation) -> float:
        """Logarithm of ∫ likelihood · prior by Laplace's method (MacKay 2003, eq. 28.5).

        Up to what all fits of the same data have in common.
        """
        n = len(self.normal)
        sign, log_det = np.linalg.slogdet(self.normal) if n else (1.0, 0.0)
        volume = (n * math.log(2 * math.pi) - log_det) / 2 if sign > 0 else -np.inf
        return volume - self.cost - self.log_size + prior.log_most(self.known, expected)
