"""Several star-shaped regions in one medium: its contrast, and how regions may lie."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from scipy.special import expit

from tomoskin.core import FloatArray
from tomoskin.inverse.iterative.shapes import LESS, MORE
from tomoskin.inverse.posterior.stars import N_PARAMETERS, StarPrior
from tomoskin.mesh import Mesh

_OUTSIDE, _MORE_OUTSIDE = 0.1, 0.05
"""Part of a region that may lie outside the medium, and the deviation of what is more."""

_OTHER, _SAME = 0.02, 0.1
"""Shared area, over that of a usual region, that costs one: of two kinds, and of one."""

_GAP = 0.125
"""Distance of two kinds of regions, over the usual radius."""

_REMEMBERED = 64
"""Regions whose cells are remembered."""


class Covers:
    """What part of each cell a region covers, about: its edges are soft over half a cell.

    A region that was asked for lately is remembered: of several, most steps move one.
    """

    def __init__(self, prior: StarPrior, mesh: Mesh) -> None:
        self.prior = prior
        self.mesh = mesh
        self.sharpness = 2.5 * prior.size / float(np.sqrt(np.median(mesh.volumes)))
        self._of_star = lru_cache(_REMEMBERED)(self._cover)

    def of(self, stars: FloatArray) -> FloatArray:
        """(n, n_cells), of latent numbers (n, 9)."""
        rows = [self._of_star(star.tobytes()) for star in stars]
        return np.stack(rows) if rows else np.zeros((0, len(self.mesh.cells)))

    def widened(self, cover: FloatArray, gap: float) -> FloatArray:
        """The same of regions that are wider by ``gap`` of the usual radius."""
        odds = cover * np.exp(self.sharpness * gap)
        return np.asarray(odds / (1.0 - cover + odds))

    def slopes(self, stars: FloatArray, cover: FloatArray) -> FloatArray:
        """(n, 9, n_cells): derivative by the latent numbers."""
        steep = self.sharpness * cover * (1.0 - cover)
        return np.asarray(self.prior.slope(stars, self.mesh.centroids) * steep[:, None])

    def _cover(self, star: bytes) -> FloatArray:
        level = self.prior.level(np.frombuffer(star)[None], self.mesh.centroids)[0]
        return np.asarray(expit(self.sharpness * level))


@dataclass(frozen=True, eq=False)
class Packing:
    """Regions of given kinds as an image: latent numbers (n·9,) → contrast of the cells.

    Where any region of a kind covers a cell, the reflection coefficient is ±``most``.

    Attributes
    ----------
    covers
        What the latent numbers mean.
    kinds
        LESS or MORE, of each region.
    most
        Reflection coefficient of a region.
    """

    covers: Covers
    kinds: tuple[int, ...]
    most: float

    @property
    def size(self) -> int:
        """Number of latent numbers."""
        return N_PARAMETERS * len(self.kinds)

    def contrast(self, latent: FloatArray) -> FloatArray:
        """(n_cells,) log of conductivity over background."""
        return np.asarray(2.0 * np.arctanh(self._reflection(self._cover(latent))))

    def chain(self, latent: FloatArray, jacobian: FloatArray) -> FloatArray:
        """(m, n·9) from the derivative by the contrast, (m, n_cells)."""
        if not self.kinds:
            return jacobian[:, :0]
        cover = self._cover(latent)
        by_union = 2.0 * self.most / (1.0 - self._reflection(cover) ** 2)
        slopes = self.covers.slopes(latent.reshape(-1, N_PARAMETERS), cover)
        for i, kind in enumerate(self.kinds):
            others = [k == kind and j != i for j, k in enumerate(self.kinds)]
            sign = 1.0 if kind == MORE else -1.0
            slopes[i] *= sign * by_union * np.prod(1.0 - cover[others], axis=0)
        return np.asarray(jacobian @ slopes.reshape(self.size, -1).T)

    def crowding(self, latent: FloatArray) -> float:
        """Cost of regions that meet or reach out of the medium, twice a negative logarithm."""
        if not self.kinds:
            return 0.0
        cover, prior, area = self._cover(latent), self.covers.prior, self.covers.mesh.volumes
        wide, usual = self.covers.widened(cover, _GAP), np.pi * prior.size**2
        both = float(area @ (self._of(MORE, wide) * self._of(LESS, wide))) / (_OTHER * usual)
        unions = self._of(MORE, cover) + self._of(LESS, cover)
        twice = float(area @ (cover.sum(axis=0) - unions)) / (_SAME * usual)
        outside = 1.0 - cover @ area / prior.areas(latent.reshape(-1, N_PARAMETERS))
        beyond = np.maximum(outside - _OUTSIDE, 0.0) / _MORE_OUTSIDE
        return 2.0 * (both + twice) + float(beyond @ beyond)

    def _cover(self, latent: FloatArray) -> FloatArray:
        return self.covers.of(latent.reshape(-1, N_PARAMETERS))

    def _reflection(self, cover: FloatArray) -> FloatArray:
        return np.asarray(self.most * (self._of(MORE, cover) - self._of(LESS, cover)))

    def _of(self, kind: int, cover: FloatArray) -> FloatArray:
        """(n_cells,) covered by any region of ``kind``."""
        return np.asarray(1.0 - np.prod(1.0 - cover[[k == kind for k in self.kinds]], axis=0))
