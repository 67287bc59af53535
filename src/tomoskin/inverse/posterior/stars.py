"""Star-shaped regions: each a centre, a size and a few waves of its outline."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tomoskin.core import FloatArray, ModelError
from tomoskin.mesh import Mesh

ORDERS = np.array([2, 3, 4])
"""Waves of an outline; the first would move the centre."""

WAVES = np.array([0.22, 0.16, 0.12])
"""Their deviations, in the logarithm of the radius."""

N_PARAMETERS = 3 + 2 * len(ORDERS)
"""Of a region: two of its centre, its size, and a cosine and a sine of each order."""

_NEAREST = 1e-9
"""A point this near the centre counts as that far from it, m."""


@dataclass(frozen=True, eq=False)
class StarPrior:
    """What a region is like before anything is measured; all parameters are standard normal.

    Its outline is r(θ) = size·exp(a + Σ bₙ cos nθ + cₙ sin nθ) around its centre.

    Attributes
    ----------
    size
        Usual radius, m.
    middle
        (2,) m, mean of the centres.
    deviation
        (9,) of the centre, m, and of the logarithms a, b₂, c₂, b₃, …
    """

    size: float
    middle: FloatArray
    deviation: FloatArray

    @classmethod
    def on(cls, mesh: Mesh, size: float, spread: float = 0.35) -> StarPrior:
        """Regions of about ``size`` m, anywhere on a flat ``mesh``.

        ``spread`` is the deviation of the size's logarithm.

        Raises
        ------
        ModelError
            For a size or spread that is not positive, or a mesh of tetrahedra.
        """
        if mesh.dimension != 2:
            raise ModelError(
                f"expected a mesh of triangles, got one of {mesh.dimension} dimensions"
            )
        for name, value in (("size", size), ("spread", spread)):
            if not (np.isfinite(value) and value > 0):
                raise ModelError(f"expected a {name} above 0, got {value}")
        share = mesh.volumes / mesh.volumes.sum()
        middle = share @ mesh.centroids
        reach = np.sqrt(share @ (mesh.centroids - middle) ** 2)
        return cls(size, middle, np.concatenate([reach, [spread], np.repeat(WAVES, 2)]))

    def ellipse(self, centre: FloatArray, radius: float, wave: complex = 0.0) -> FloatArray:
        """(9,) latent numbers of a round region, or of one with ``wave`` b₂ + i·c₂."""
        values = np.zeros(N_PARAMETERS)
        values[:2] = centre - self.middle
        values[2:5] = np.log(radius / self.size), wave.real, wave.imag
        return values / self.deviation

    def centres(self, latent: FloatArray) -> FloatArray:
        """(n, 2) m, from (n, 9)."""
        return np.asarray(self.middle + self.deviation[:2] * latent[:, :2])

    def radii(self, latent: FloatArray) -> FloatArray:
        """(n,) m, from (n, 9)."""
        return np.asarray(self.size * np.exp(self.deviation[2] * latent[:, 2]))

    def areas(self, latent: FloatArray) -> FloatArray:
        """(n,) m², from (n, 9)."""
        angle = np.arange(24) * (2 * np.pi / 24)
        turned = np.exp(1j * np.outer(ORDERS, angle))
        outline = self.radii(latent)[:, None] * np.exp((self._waves(latent) @ turned).real)
        return np.asarray(np.pi * (outline**2).mean(axis=1))

    def level(self, latent: FloatArray, points: FloatArray) -> FloatArray:
        """(n, k): logarithm of the outline's radius over the distance of ``points`` (k, 2) m.

        Positive inside; times the size it is about the distance from the outline.
        """
        return self._polar(latent, points)[0]

    def slope(self, latent: FloatArray, points: FloatArray) -> FloatArray:
        """(n, 9, k): derivative of :meth:`level` by the latent numbers."""
        _, away, unit = self._polar(latent, points)
        powers = unit[:, None] ** ORDERS[:, None]
        turn = ((1j * ORDERS * self._waves(latent))[:, :, None] * powers).real.sum(axis=1)
        by_centre = unit * (1.0 - 1j * turn) / away
        waves = np.stack([powers.real, powers.imag], axis=2).reshape(len(latent), -1, len(points))
        parts = [by_centre.real[:, None], by_centre.imag[:, None], np.ones_like(away)[:, None]]
        return np.concatenate([*parts, waves], axis=1) * self.deviation[:, None]

    def _waves(self, latent: FloatArray) -> NDArray[np.complex128]:
        """(n, orders): bₙ − i·cₙ, whose products with exp(inθ) have the wave as real part."""
        values = latent[:, 3:] * self.deviation[3:]
        return np.asarray(values[:, ::2] - 1j * values[:, 1::2])

    def _polar(
        self, latent: FloatArray, points: FloatArray
    ) -> tuple[FloatArray, FloatArray, NDArray[np.complex128]]:
        """Level, distance from the centre and direction, each (n, k)."""
        at = points @ np.array([1.0, 1j]) - (self.centres(latent) @ np.array([1.0, 1j]))[:, None]
        away = np.maximum(np.sqrt(at.real**2 + at.imag**2), _NEAREST)
        unit = at / away
        # Horner from the highest order down to the second
        waves = self._waves(latent)[..., None]
        total = waves[:, -1] * unit
        for k in range(len(ORDERS) - 2, -1, -1):
            total = (total + waves[:, k]) * unit
        size = np.log(self.size) + self.deviation[2] * latent[:, 2]
        return size[:, None] + (total * unit).real - np.log(away), away, unit
