"""Structured boxes of tetrahedra with rectangular electrodes on any side."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np
from numpy.typing import NDArray

from tomoskin.core import FloatArray, GeometryError, IntArray
from tomoskin.model.mesh.extrude import Body, grid_lines
from tomoskin.model.mesh.mesh import Mesh
from tomoskin.model.mesh.outline import check_size
from tomoskin.model.mesh.triangles import boundary_facets

Side = Literal["-x", "+x", "-y", "+y", "-z", "+z"]
"""A side of a box: the end of an axis."""


@dataclass(frozen=True, slots=True)
class BoxPatch:
    """Electrode on a side of a box: all of it, or the rectangle from ``low`` to ``high``, m.

    The corners are given in the side's two coordinates, in the order x, y, z: (y, z) on −x and
    +x, (x, z) on −y and +y, (x, y) on −z and +z. It is resolved exactly.
    """

    side: Side
    low: tuple[float, float] | None = None
    high: tuple[float, float] | None = None

    @property
    def axis(self) -> int:
        """Axis that the side is perpendicular to."""
        return "xyz".index(self.side[1])


def box(
    size: tuple[float, float, float],
    cells: tuple[int, int, int],
    electrodes: Sequence[BoxPatch],
) -> Mesh:
    """Box of ``size`` m: x and y around 0, z from 0 up; six tetrahedra to a brick.

    ``cells`` is the number of bricks along x, y and z. Electrodes that do not cover their side
    add grid lines at their edges, with finer bricks beside them and, all in all, about the same
    number or as many as they need.

    Raises
    ------
    GeometryError
        For a size or number that is not above 0, an electrode that leaves its side or shares
        facets with another one.
    """
    for name, length in zip("xyz", size, strict=True):
        check_size(f"length along {name}", length)
    half = np.array([size[0], size[1]]) / 2
    extent = np.array([[-half[0], half[0]], [-half[1], half[1]], [0.0, size[2]]])
    ranges = [_ranges(p, extent, f"E{i}") for i, p in enumerate(electrodes, 1)]
    x, y, z = (
        grid_lines(low, high, [m for r in ranges for m in r.get(i, ())], cells[i])
        for i, (low, high) in enumerate(extent.tolist())
    )
    body = Body(*_bricks(x, y), z)
    return body.mesh([_facets(body, p, r, extent) for p, r in zip(electrodes, ranges, strict=True)])


def _ranges(patch: BoxPatch, extent: FloatArray, where: str) -> dict[int, tuple[float, float]]:
    """Axis → from, to of the two axes in which the patch extends, m."""
    if patch.side not in get_args(Side):
        sides = ", ".join(get_args(Side))
        raise GeometryError(f'expected a side among {sides}, got "{patch.side}"', where=where)
    axes = [i for i in range(3) if i != patch.axis]
    lows = patch.low or extent[axes, 0].tolist()
    highs = patch.high or extent[axes, 1].tolist()
    for axis, low, high in zip(axes, lows, highs, strict=True):
        least, most = extent[axis]
        if not least <= low < high <= most:
            raise GeometryError(
                f"expected an interval of {'xyz'[axis]} within {least * 1e3:.4g} to "
                f"{most * 1e3:.4g} mm on side {patch.side}, "
                f"got {low * 1e3:.4g} to {high * 1e3:.4g} mm",
                where=where,
            )
    return dict(zip(axes, zip(lows, highs, strict=True), strict=True))


def _bricks(x: FloatArray, y: FloatArray) -> tuple[FloatArray, IntArray]:
    """Points (n, 2) of the grid x × y, x fastest, and its triangles, two to a rectangle."""
    nx = len(x)
    points = np.column_stack([np.tile(x, len(y)), np.repeat(y, nx)])
    corner = (np.arange(len(y) - 1)[:, None] * nx + np.arange(nx - 1)).ravel()
    lower = np.column_stack([corner, corner + 1, corner + nx + 1])
    upper = np.column_stack([corner, corner + nx + 1, corner + nx])
    return points, np.concatenate([lower, upper])


def _facets(
    body: Body, patch: BoxPatch, ranges: dict[int, tuple[float, float]], extent: FloatArray
) -> IntArray:
    """Facets of ``patch``: its edges are grid lines, so that centroids tell."""
    if patch.axis == 2:
        chosen = _within(body.flat[body.triangles].mean(axis=1), ranges)
        return body.face(chosen, -1 if patch.side == "+z" else 0)
    edges = boundary_facets(body.triangles)
    end = extent[patch.axis, 1 if patch.side[0] == "+" else 0]
    on_side = (body.flat[edges][:, :, patch.axis] == end).all(axis=1)
    edges = edges[on_side]
    middle = body.flat[edges].mean(axis=1)
    bottom, top = ranges[2]
    along = {axis: span for axis, span in ranges.items() if axis != 2}
    return body.wall(edges[_within(middle, along)], bottom, top)


def _within(xy: FloatArray, ranges: dict[int, tuple[float, float]]) -> NDArray[np.bool_]:
    inside = [(xy[:, i] > low) & (xy[:, i] < high) for i, (low, high) in ranges.items()]
    return np.asarray(np.logical_and.reduce(inside))
