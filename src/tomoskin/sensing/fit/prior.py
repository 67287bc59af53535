"""What is held to be likely of a touch before the data speak."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar, Self

import numpy as np

from tomoskin.core import FloatArray
from tomoskin.model.mesh import Mesh
from tomoskin.sensing.fit.expectation import Expectation, Known
from tomoskin.sensing.fit.spot import CONTENT, FILLING, LOG_RADIUS

_RADIUS = 0.11
"""Median radius where touches are as large as the sheet lets them be, in parts of its breadth: that
of a square of the same area."""

_FINGER = 0.0195
"""Median radius of the dent of a finger, m, however large the sheet is."""

_SPREAD = 0.45
"""Standard deviation of the radius's logarithm where both agree: a factor of 1.6 either way."""

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
    """

    directed: ClassVar = 0.7
    """Standard deviation of a spot's direction (:class:`Part`) about none."""

    reshaped: ClassVar = 0.5
    """Standard deviation of its shape, of the way from a tail to a bell: both are one from ours."""

    area: float
    radius: float
    spread: float
    content: float

    @classmethod
    def of(cls, mesh: Mesh) -> Self:
        """For a sheet of this size, whose touches may be fingers or as small as the sheet.

        The median lies between the two sizes, and the spread holds both.
        """
        area = float(mesh.volumes.sum())
        scaled = _RADIUS * math.sqrt(area)
        radius = math.sqrt(scaled * _FINGER)
        spread = math.hypot(_SPREAD, math.log(scaled / _FINGER) / 2)
        return cls(area, radius, spread, _DEPTH * FILLING * radius**2)

    def widest(self, spots: FloatArray) -> float:
        """Deviations of the prior by which the widest of spots (k, 4) is wide."""
        return float(((spots[:, LOG_RADIUS] - math.log(self.radius)) / self.spread).max())

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
        kept[:, LOG_RADIUS] = np.clip(kept[:, LOG_RADIUS], *self.log_radii)
        low, high = self.depths(sign)
        filling = FILLING * np.exp(2 * kept[:, LOG_RADIUS])
        kept[:, CONTENT] = np.clip(kept[:, CONTENT], low * filling, high * filling)
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
        return (
            0.0 if sign == "increase" else -_MOST_DEPTH,
            0.0 if sign == "decrease" else _MOST_DEPTH,
        )
