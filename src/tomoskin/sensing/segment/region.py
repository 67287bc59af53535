"""Where a touch may be: a polygon, its own unit of length, and a grid of positions in it."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar, Self

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import ConvexHull, QhullError

from tomoskin.core import DataError, FloatArray
from tomoskin.model.mesh import centroid, inside, off_segment, signed_area
from tomoskin.model.skin import Skin

_POSITIONS = 1500
"""Positions in the grid, unless another number is asked for."""

_CORNERS = 120
"""Corners of a round outline."""

_BEYOND = 1.5
"""The hull of n presses is grown by this part of n^(−2/3): so far its edge lies inside."""


@dataclass(frozen=True, eq=False)
class Region:
    """A polygon with the corners ``outline`` (k, 2) m.

    Inside the locator a position is measured from ``centre`` in units of ``unit``, the radius of
    the disc of the same area.
    """

    FARTHEST: ClassVar = 1e6
    """Metres from the origin at which there is no skin."""

    outline: FloatArray

    @classmethod
    def of(cls, skin: Skin) -> Self:
        """The region within a skin's outline."""
        rim = skin.outline
        return cls(rim.polyline(rim.length / _CORNERS))

    @classmethod
    def around(cls, xy: FloatArray) -> Self:
        """The hull of presses (n, 2) m, grown by what their number leaves unseen.

        Raises DataError when the presses lie on one line.
        """
        try:
            hull = ConvexHull(xy)
        except (QhullError, ValueError) as error:
            raise DataError(
                f"expected presses that are spread over the skin, but all {len(xy)} lie on "
                "one line",
                where="xy",
            ) from error
        corners = xy[hull.vertices]
        middle = centroid(corners)
        return cls(middle + (1 + _BEYOND * len(xy) ** (-2 / 3)) * (corners - middle))

    @classmethod
    def checked(cls, outline: FloatArray) -> Self:
        """The polygon; DataError unless it has three finite corners that enclose something."""
        good = outline.ndim == 2 and outline.shape[1:] == (2,) and len(outline) >= 3
        good = good and bool((np.abs(outline) <= cls.FARTHEST).all())
        if not good or not abs(signed_area(outline)) > 0:
            raise DataError(
                "expected an outline of at least three corners around an area, "
                f"got shape {outline.shape}"
            )
        return cls(outline)

    @cached_property
    def centre(self) -> FloatArray:
        """(2,) m, the centroid of the polygon."""
        return centroid(self.outline)

    @cached_property
    def unit(self) -> float:
        """Radius of the disc of the same area, m."""
        return float(np.sqrt(abs(signed_area(self.outline)) / np.pi))

    def scaled(self, xy: FloatArray) -> FloatArray:
        """Positions (n, 2) m in the locator's own unit."""
        return np.asarray((xy - self.centre) / self.unit)

    def metres(self, positions: FloatArray) -> FloatArray:
        """Positions in m of those in the locator's own unit."""
        return np.asarray(self.centre + self.unit * positions)

    def holds(self, xy: FloatArray) -> NDArray[np.bool_]:
        """(n,) whether the positions (n, 2) m are inside, by the even-odd rule."""
        return inside(self.outline, xy)

    def beyond(self, xy: FloatArray) -> FloatArray:
        """(n,) m by which the positions (n, 2) m lie outside the outline; 0 for those inside."""
        ends = np.roll(self.outline, -1, axis=0)
        distance = off_segment(xy[:, None], self.outline, ends).min(axis=1)
        return np.where(self.holds(xy), 0.0, distance)

    @cached_property
    def grid(self) -> FloatArray:
        """(g, 2) positions in the locator's unit, on a hexagonal lattice."""
        return self.lattice(_POSITIONS)

    def lattice(self, n_places: int) -> FloatArray:
        """The same with about so many positions."""
        step = np.sqrt(2 * np.pi / (np.sqrt(3) * n_places))
        positions = hexagonal_grid(self.scaled(self.outline), step)
        return positions[self.holds(self.metres(positions))]


def hexagonal_grid(points: FloatArray, step: float) -> FloatArray:
    """(n, 2) of a hexagonal lattice over ``points`` (k, 2), ``step`` from each to the next."""
    low, high = points.min(axis=0), points.max(axis=0)
    x = np.arange(low[0], high[0] + step, step)
    y = np.arange(low[1], high[1] + step, step * np.sqrt(3) / 2)
    across, up = np.meshgrid(x, y)
    across[1::2] += step / 2
    return np.column_stack([across.ravel(), up.ravel()])
