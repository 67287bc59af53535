"""Test targets: small discs of changed conductivity, and the exact voltages that they cause."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property, lru_cache
from itertools import product

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial import cKDTree

from tomoskin.core import DataError, FloatArray, IntArray, ModelError
from tomoskin.model.forward import ForwardModel
from tomoskin.model.mesh import Mesh

_PER_EDGE = 4


class Balls:
    """Discs on a sheet, or balls in a volume, as shares of the cells of ``mesh``.

    Each cell is sampled at points of equal weight (10 in a triangle, 20 in a tetrahedron).
    """

    def __init__(self, mesh: Mesh) -> None:
        self.mesh = mesh
        share = _lattice(mesh.dimension)
        self._points_per_cell = len(share)
        self._points = np.einsum("qk,ckd->cqd", share, mesh.points[mesh.cells])

    @cached_property
    def _tree(self) -> cKDTree:
        return cKDTree(self._points.reshape(-1, self._points.shape[2]))

    def each(self, positions: FloatArray, radius: float) -> Iterator[tuple[IntArray, FloatArray]]:
        """Cells (k,) and their share (k,) within ``radius`` m of each position, (n, d)."""
        for within in self._tree.query_ball_point(positions, radius):
            cells, count = np.unique(
                np.asarray(within, dtype=np.int64) // self._points_per_cell, return_counts=True
            )
            yield cells, count / self._points_per_cell

    def share(self, position: FloatArray, radius: float) -> FloatArray:
        """(n_cells,) share of each cell within ``radius`` m of ``position`` (d,)."""
        within = np.einsum("cqd,cqd->cq", *(2 * [self._points - position])) <= radius**2
        return np.asarray(within.mean(axis=1))


@lru_cache
def _lattice(dimension: int) -> FloatArray:
    """(q, dimension + 1) barycentric coordinates, evenly spread and off the edges."""
    steps = [s for s in product(range(_PER_EDGE), repeat=dimension) if sum(s) < _PER_EDGE]
    table = np.array([[*s, _PER_EDGE - 1 - sum(s)] for s in steps], dtype=np.float64)
    return np.asarray((table + 1.0 / (dimension + 1)) / _PER_EDGE)


@dataclass(frozen=True, eq=False)
class Targets:
    """Discs (in a volume, balls) of one size and contrast, one at a time.

    Attributes
    ----------
    places
        (n, d) m, the centroid of each target.
    radius
        m.
    contrast
        Change of conductivity inside, as a part of what was there.
    amount
        (n,) change of conductivity, integrated over the target: S·m² or S/m·m³.
    dv
        (n, n_meas) difference data.
    difference
        Their kind, "plain" or "normalised".
    pattern_id
        ``Pattern.identity`` of their rows.
    """

    places: FloatArray
    radius: float
    contrast: float
    amount: FloatArray
    dv: FloatArray
    difference: str
    pattern_id: str

    @classmethod
    def simulate(
        cls,
        model: ForwardModel,
        places: ArrayLike,
        *,
        radius: float,
        contrast: float = -0.1,
        conductivity: ArrayLike = 1.0,
        difference: str = "plain",
    ) -> Targets:
        """Targets at ``places`` (n, d), by the exact local update of ``model``.

        Give a finer mesh than that of the operator under test: its own would flatter it. A
        target over the rim is cut there.

        Raises
        ------
        ModelError
            For a radius that is not above 0, a contrast that is 0 or not above −1, a difference
            that is not known, or complex voltages.
        DataError
            For a position that has no cell within the radius, naming it.
        """
        table = _checked(places, model.mesh, radius, contrast, difference)
        state = model.at(conductivity)
        if state.conductivity.ndim > 1 or np.iscomplexobj(state.voltages):
            raise ModelError(
                "expected a real conductivity per cell and a real contact impedance, "
                "got tensors or complex values"
            )
        shares = list(Balls(model.mesh).each(table, radius))
        _refuse_empty(shares)
        sigma, content = state.conductivity, model.mesh.volumes
        touches = [(c, sigma[c] * (1.0 + contrast * share)) for c, share in shares]
        dv = state.local.voltages_of(touches) - state.voltages
        weights = [(c, share * content[c]) for c, share in shares]
        if difference == "normalised":
            dv /= np.abs(state.voltages)
        return cls(
            np.array([w @ model.mesh.centroids[c] / w.sum() for c, w in weights]),
            radius,
            contrast,
            np.array([contrast * w @ sigma[c] for c, w in weights]),
            dv,
            difference,
            model.pattern.identity,
        )


def _refuse_empty(shares: list[tuple[IntArray, FloatArray]]) -> None:
    empty = [number for number, (cells, _) in enumerate(shares) if not len(cells)]
    if empty:
        raise DataError(
            "lies outside the sheet, or between its cells",
            where=f"target {empty[0]}",
            hint="move it, or choose a radius above the size of a cell",
        )


def along(mesh: Mesh, end: ArrayLike, count: int) -> FloatArray:
    """(count, d) positions from the sheet's centroid towards ``end`` (d,) m, both included."""
    if count < 1:
        raise DataError(f"expected at least 1 target, got {count}")
    start = centre_of(mesh)
    return np.asarray(start + np.linspace(0, 1, count)[:, None] * (np.asarray(end) - start))


def centre_of(mesh: Mesh) -> FloatArray:
    """(d,) m: centroid of the sheet or volume."""
    return np.asarray(mesh.volumes @ mesh.centroids / mesh.volumes.sum())


def _checked(
    positions: ArrayLike, mesh: Mesh, radius: float, contrast: float, difference: str
) -> FloatArray:
    table = np.asarray(positions, dtype=np.float64)
    d = mesh.points.shape[1]
    if table.ndim != 2 or table.shape[1] != d or not len(table):
        raise DataError(f"expected positions of shape (n, {d}), got shape {table.shape}")
    if not np.isfinite(table).all():
        raise DataError("expected finite positions, got values that are not finite")
    if not (np.isfinite(radius) and radius > 0):
        raise ModelError(f"expected a radius above 0 m, got {radius}")
    if not (np.isfinite(contrast) and contrast > -1 and contrast != 0):
        raise ModelError(f"expected a contrast above -1 and not 0, got {contrast}")
    if difference not in ("plain", "normalised"):
        raise ModelError(f'expected difference "plain" or "normalised", got "{difference}"')
    return table
