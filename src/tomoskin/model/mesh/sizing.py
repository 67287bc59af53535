"""How large a cell should be where: small at sources, growing with distance, capped."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.spatial import cKDTree

from tomoskin.core import FloatArray


@dataclass(frozen=True, eq=False)
class SizeField:
    """Edge length wanted at a point: min(coarse, minᵢ(sizesᵢ + growth·|x − pointsᵢ|)).

    Attributes
    ----------
    coarse
        Edge length far from every source, m.
    points
        (n, 2) sources, m.
    sizes
        (n,) edge length wanted at each, m.
    growth
        Edge length gained per unit of distance from a source.
    """

    coarse: float
    points: FloatArray
    sizes: FloatArray
    growth: float

    def __call__(self, xy: FloatArray) -> FloatArray:
        """(n,) edge length wanted at ``xy`` (n, 2), m; the nearest few sources decide."""
        reach = (self.coarse - self.sizes.min()) / self.growth
        if reach <= 0:
            return np.full(len(xy), self.coarse)
        k = min(8, len(self.sizes))
        gap, index = self._tree.query(xy, k=k, distance_upper_bound=reach)
        padded = np.append(self.sizes, np.inf)  # the tree says n for "no neighbour"
        size = (padded[index] + self.growth * gap).reshape(len(xy), k).min(axis=1)
        return np.asarray(np.minimum(size, self.coarse))

    @cached_property
    def _tree(self) -> cKDTree:
        return cKDTree(self.points)


def running(density: FloatArray, at: FloatArray) -> FloatArray:
    """(n,) integral of a density (n,) from the first of the places ``at`` (n,) to each."""
    steps = np.diff(at) * (density[1:] + density[:-1]) / 2
    return np.concatenate([[0.0], np.cumsum(steps)])
