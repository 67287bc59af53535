"""What an image of a small target should look like, and how much each cell of it matters."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse import csr_array

from tomoskin.core import FloatArray, ModelError
from tomoskin.inverse.greit.targets import Balls
from tomoskin.mesh import Mesh


@dataclass(frozen=True, slots=True)
class Desired:
    """A flat disc around the target, then an edge of free form, then nothing.

    The disc holds the target's change of conductivity, spread evenly: what of it lies beyond
    the rim is held by the rest. In a volume it is a ball. The defaults were chosen on targets
    along a radius of discs with 8 and 16 electrodes; an edge or unequal weights sharpen or calm
    the image at the price of its amplitude.

    Attributes
    ----------
    radius
        Of the disc, as a part of the sheet's largest extent.
    edge
        Width of the ring around it whose cells do not matter, likewise.
    inside, outside
        Weight of an error within the disc and beyond the ring (Adler et al. 2009, section 3.2).
    """

    radius: float = 0.15
    edge: float = 0.0
    inside: float = 1.0
    outside: float = 1.0

    def __post_init__(self) -> None:
        """Raise ModelError for a size or weight that is impossible."""
        for name, low in (("radius", True), ("edge", False), ("inside", True), ("outside", True)):
            value = getattr(self, name)
            if not (np.isfinite(value) and (value > 0 if low else value >= 0)):
                bound = "above 0" if low else "of 0 or more"
                raise ModelError(f"expected {name} {bound}, got {value}", where="desired response")

    def on(self, mesh: Mesh, places: FloatArray) -> tuple[csr_array, csr_array]:
        """Weights and weighted images for unit targets at ``places`` (n, d).

        Returns
        -------
        Both (n_cells, n) and sparse: the weight of each cell less that outside, and weight
        times desired value, per S·m².
        """
        extent = float(np.ptp(mesh.points, axis=0).max())
        balls = Balls(mesh)
        disc = _shares(balls, places, self.radius * extent)
        ring = _shares(balls, places, (self.radius + self.edge) * extent)
        size = mesh.volumes @ disc
        if not (size > 0).all():
            raise ModelError(
                "the desired disc is smaller than the mesh can show",
                hint="widen its radius, or refine the mesh",
            )
        scaled = disc.multiply(1.0 / size[None, :])
        return csr_array(self.inside * disc - self.outside * ring), csr_array(self.inside * scaled)


def _shares(balls: Balls, places: FloatArray, radius: float) -> csr_array:
    cells, shares, columns = [], [], []
    for number, (cell, share) in enumerate(balls.each(places, radius)):
        cells.append(cell)
        shares.append(share)
        columns.append(np.full(len(cell), number))
    where = (np.concatenate(cells), np.concatenate(columns))
    shape = (len(balls.mesh.cells), len(places))
    return csr_array((np.concatenate(shares), where), shape=shape)
