"""Spots that explain a frame: what is held to be likely of one before the data speak, the fit, and
what the table of responses lacks of them."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from functools import cached_property
from typing import Self

import numpy as np

from tomoskin.core import FloatArray
from tomoskin.model.mesh import Mesh
from tomoskin.sensing.fit import profile, spot
from tomoskin.sensing.fit.expectation import Expectation, Known

_RADIUS = 0.11
"""Median radius where touches are as large as the sheet lets them be, in parts of its breadth: that
of a square of the same area."""

_FINGER = 0.0195
"""Median radius of the dent of a finger, m, however large the sheet is."""

_SPREAD = 0.45
"""Standard deviation of the radius's logarithm where both agree: a factor of 1.6 either way."""

_ON_LAYER = 0.25
"""The same on a layer whose thickness is given: that says how far the sheet is carried along."""

_SURER = 0.9, 0.12
"""Deviations of direction and shape there: its thickness says what the profile is."""

_LEAST, _MOST = 0.045, 0.45
"""Radii that a sheet can show, in parts of its breadth: larger than its cells, smaller than it."""

_DEPTH = 0.5
"""Standard deviation of log(σ/σ₀) at the centre of a spot of median radius, about none."""

_MOST_DEPTH = 3.0
"""A spot that is deeper (a conductivity of 5 %) differs from this one by less than its noise."""


@dataclass(frozen=True)
class SpotPrior:
    """Each spot alone: its position even over the sheet, radius log-normal, content normal.

    Attributes
    ----------
    area
        Of the sheet, m².
    radius
        Median, m.
    spread
        Standard deviation of the radius's logarithm.
    content
        Standard deviation of the content about none, m².
    directed
        Standard deviation of a spot's direction (:class:`Part`) about none.
    reshaped
        Standard deviation of its shape, of the way from a tail to a bell: both are one from ours.
    """

    area: float
    radius: float
    spread: float
    content: float
    directed: float = field(default=0.7, repr=False)  # no table depends on these
    reshaped: float = field(default=0.5, repr=False)

    @classmethod
    def of(cls, mesh: Mesh, layer: float | None = None) -> Self:
        """For a sheet of this size, whose touches may be fingers or as small as the sheet.

        The median lies between the two sizes, and the spread holds both; but on a ``layer`` m thick
        a touch is as large as its :class:`Profile`.
        """
        area = float(mesh.volumes.sum())
        if layer is not None:
            return cls(
                area, profile.USUAL, _ON_LAYER, _DEPTH * profile.FILLING * profile.USUAL**2, *_SURER
            )
        scaled = _RADIUS * math.sqrt(area)
        radius = math.sqrt(scaled * _FINGER)
        spread = math.hypot(_SPREAD, math.log(scaled / _FINGER) / 2)
        return cls(area, radius, spread, _DEPTH * profile.FILLING * radius**2)

    def widest(self, spots: FloatArray) -> float:
        """Deviations of the prior by which the widest of spots (k, 4) is wide."""
        return float(((spots[:, spot.LOG_RADIUS] - math.log(self.radius)) / self.spread).max())

    @property
    def middle(self) -> FloatArray:
        """(4,) of each column; positions have none."""
        return np.array([0.0, 0.0, math.log(self.radius), 0.0])

    @property
    def weights(self) -> FloatArray:
        """(4,) 1/deviation of each column; a position is on the sheet."""
        wide = 1 / math.sqrt(self.area)
        return np.array([wide, wide, 1 / self.spread, 1 / self.content])

    def log_most(self, known: Known, expected: Expectation) -> float:
        """Logarithm of the density of spots at their most likely; newcomers are in no order."""
        old = [number for number in known if number is not None]
        new = len(known) - len(old)
        going_on = len(old) * self.log_content + float(expected.log_volumes[old].sum())
        return math.lgamma(new + 1) - new * self.log_volume - going_on

    @property
    def log_content(self) -> float:
        """What the content has of :attr:`log_volume`."""
        return math.log(self.content) + math.log(2 * math.pi) / 2

    @property
    def log_volume(self) -> float:
        """Logarithm of one over the density of one spot at its most likely."""
        return math.log(self.area * self.spread * self.content) + math.log(2 * math.pi)

    def held(self, spots: FloatArray, sign: str) -> FloatArray:
        """``spots`` (k, 4) with radius and content where they may be."""
        kept = spots.copy()
        kept[:, spot.LOG_RADIUS] = np.clip(kept[:, spot.LOG_RADIUS], *self.log_radii)
        low, high = self.depths(sign)
        filling = profile.FILLING * np.exp(2 * kept[:, spot.LOG_RADIUS])
        kept[:, spot.CONTENT] = np.clip(kept[:, spot.CONTENT], low * filling, high * filling)
        return kept

    @property
    def log_radii(self) -> tuple[float, float]:
        """Least and largest logarithm of a radius in m."""
        middle, margin, breadth = math.log(self.radius), 2 * self.spread, math.log(self.area) / 2
        least, most = (breadth + math.log(part) for part in (_LEAST, _MOST))
        return max(middle - margin, least), min(middle + margin, most)

    @staticmethod
    def depths(sign: str) -> tuple[float, float]:
        """Least and largest log(σ/σ₀) at the centre: ``sign`` as in a skin's ``[touch]``."""
        return spot.bounds_of(sign, _MOST_DEPTH)


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
        return cls(np.zeros((0, spot.N_PARAMETERS)), np.zeros(rank))

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

    @cached_property
    def noise(self) -> FloatArray:
        """(4k, 4k): what noise of this frame's data, and nothing else, adds to the covariance.

        The least squares are P JC⁻¹ of the data, with P the covariance and C what the unknown
        directions have beside white noise. What they may answer is the same in the next frame.
        """
        taken, unknown = self.slopes, self.unknown
        if len(unknown):
            metric = np.eye(len(unknown)) + unknown @ unknown.T
            taken = taken - np.linalg.solve(metric, unknown @ taken.T).T @ unknown
        moved = self.covariance @ taken
        return np.asarray(moved @ moved.T)

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
