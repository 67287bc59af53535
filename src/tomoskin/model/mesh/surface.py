"""Surfaces that a sheet is laid on: where its points come to lie, and how it is stretched there.

A sheet keeps its flat coordinates (u, v) on every surface: mesh, electrodes, images and touches
stay as they are, and what the surface does to lengths enters as the mesh's metric, the first
fundamental form of the map (do Carmo, Differential Geometry of Curves and Surfaces, 2.5).
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from tomoskin.core import FloatArray, GeometryError
from tomoskin.model.mesh.mesh import Mesh
from tomoskin.model.mesh.outline import check_size
from tomoskin.model.mesh.triangles import SIDES

_ISOMETRIC = 1e-12
"""A metric that differs from that of the plane by less is rounding."""

_STEP = 1e-5
"""Of the differences that curvatures are made of, m."""

_GAUSS = np.polynomial.legendre.leggauss(4)
"""Places and weights along a side, from −1 to 1."""


class Surface(ABC):
    """A map from the sheet's plane, (u, v) in m, into space; u to the right, v up."""

    @abstractmethod
    def point(self, uv: ArrayLike) -> FloatArray:
        """(n, 3) m: where the sheet's points (n, 2) lie; the front looks along :meth:`normal`."""

    @abstractmethod
    def jacobian(self, uv: ArrayLike) -> FloatArray:
        """(n, 3, 2): derivative of :meth:`point` by u and v."""

    def check(self, uv: ArrayLike) -> None:
        """Raise GeometryError where a sheet with these points (n, 2) m does not fit on it."""
        rows_of(uv)

    def normal(self, uv: ArrayLike) -> FloatArray:
        """(n, 3) unit vectors away from the body, towards who touches it."""
        step = self.jacobian(uv)
        across = np.cross(step[:, :, 0], step[:, :, 1])
        return np.asarray(across / np.linalg.norm(across, axis=1, keepdims=True))

    def curvature(self, uv: ArrayLike) -> FloatArray:
        """(n, 2, 2) 1/m: second fundamental form, negative where the front is convex."""
        uv = rows_of(uv)
        steps = _STEP * np.eye(2)
        bend = [self.jacobian(uv + d) - self.jacobian(uv - d) for d in steps]
        second = np.stack(bend, axis=-1) / (2 * _STEP)
        form = np.einsum("nk,nkij->nij", self.normal(uv), second)
        return np.asarray((form + form.transpose(0, 2, 1)) / 2)

    def metric(self, uv: ArrayLike) -> FloatArray:
        """(n, 2, 2) first fundamental form JᵀJ."""
        step = self.jacobian(uv)
        return np.asarray(step.transpose(0, 2, 1) @ step)


def laid_on(mesh: Mesh, surface: Surface) -> Mesh:
    """The flat ``mesh`` with the lengths that its sheet has on ``surface``.

    Where the surface only bends it, it is the same mesh: operators made for it still serve.

    Raises
    ------
    GeometryError
        When the mesh is not a flat sheet, does not fit on the surface, or is too coarse for it.
    """
    if mesh.dimension != 2 or mesh.points.shape[1] != 2:
        raise GeometryError("expected a flat sheet of triangles, got a volume or a curved sheet")
    surface.check(mesh.points)
    metric = _of_lengths(mesh, surface)
    torn = np.flatnonzero(~(np.linalg.det(metric) > 0))
    if len(torn):
        x, y = 1e3 * mesh.centroids[torn[0]]
        raise GeometryError(
            f"the surface is too rough for the sheet: {len(torn)} triangles cannot be laid on "
            f"it, the first near ({x:.4g}, {y:.4g}) mm of the sheet",
            where=f"cell {torn[0]}",
            hint="smooth the surface, repair its folds, or use more cells",
        )
    flat = np.abs(metric - np.eye(2)).max() < _ISOMETRIC
    return replace(mesh, metric=None if flat else metric)


def _of_lengths(mesh: Mesh, surface: Surface) -> FloatArray:
    """(n_cells, 2, 2): in each cell the one metric that gives its three sides their lengths.

    Neighbours agree on the side that they share, and an electrode's facet has its own length
    (Regge, Il Nuovo Cimento 19 (1961) 558).
    """
    corner = mesh.points[mesh.cells]
    squares, terms = [], []
    for a, b in SIDES:
        step, middle = corner[:, b] - corner[:, a], (corner[:, a] + corner[:, b]) / 2
        length = np.zeros(len(corner))
        for node, weight in zip(*_GAUSS, strict=True):
            metric = surface.metric(middle + node / 2 * step)
            length += weight / 2 * np.sqrt(np.einsum("ni,nij,nj->n", step, metric, step))
        squares.append(length**2)
        x, y = step.T
        terms.append(np.column_stack([x * x, 2 * x * y, y * y]))
    sides = np.stack(squares, axis=1)[..., None]
    entries = np.linalg.solve(np.stack(terms, axis=1), sides)[..., 0]
    return np.asarray(entries[:, [[0, 1], [1, 2]]])


_FLAT = np.eye(3)[None, :, :2]


@dataclass(frozen=True)
class Plane(Surface):
    """The surface of a sheet that lies flat."""

    def point(self, uv: ArrayLike) -> FloatArray:
        """The points (n, 3) in m, with z = 0."""
        uv = rows_of(uv)
        out = np.zeros((len(uv), 3))
        out[:, :2] = uv
        return out

    def jacobian(self, uv: ArrayLike) -> FloatArray:
        """The unit vectors of u and v, at every point."""
        return np.repeat(_FLAT, len(rows_of(uv)), axis=0)


@dataclass(frozen=True)
class Cap(Surface):
    """Drawn over a sphere from its middle outwards, true to length along every radius.

    Lengths around shrink to R sin(r/R)/r of what they were (azimuthal equidistant map).
    """

    radius: float

    def __post_init__(self) -> None:
        """Refuse an impossible radius."""
        check_size("radius", self.radius)

    def point(self, uv: ArrayLike) -> FloatArray:
        """Points (n, 3) m of the surface."""
        uv = rows_of(uv)
        angle = np.linalg.norm(uv, axis=1) / self.radius
        return np.column_stack(
            [uv * np.sinc(angle / np.pi)[:, None], self.radius * (np.cos(angle) - 1.0)]
        )

    def jacobian(self, uv: ArrayLike) -> FloatArray:
        """From the derivatives of sin(r/R)/(r/R), which are smooth in the middle."""
        uv = rows_of(uv)
        angle = np.linalg.norm(uv, axis=1) / self.radius
        ratio = np.sinc(angle / np.pi)
        out = np.zeros((len(uv), 3, 2))
        bend = _sinc_slope(angle) / self.radius**2
        out[:, :2] = ratio[:, None, None] * np.eye(2) + bend[:, None, None] * (
            uv[:, :, None] * uv[:, None, :]
        )
        out[:, 2] = -uv * ratio[:, None] / self.radius
        return out

    def check(self, uv: ArrayLike) -> None:
        """The sheet must end before the sphere's far side."""
        reach = float(np.linalg.norm(rows_of(uv), axis=1).max())
        if reach >= 0.95 * math.pi * self.radius:
            raise GeometryError(
                f"a sphere of radius {1e3 * self.radius:.4g} mm is covered at "
                f"{1e3 * math.pi * self.radius:.4g} mm from the middle, but the sheet extends "
                f"{1e3 * reach:.4g} mm from its middle",
                hint="take a larger radius",
            )


@dataclass(frozen=True)
class Saddle(Surface):
    """Hung over a saddle: z = v²/2R_v − u²/2R_u over the plane; R in m, inf is straight.

    A chair's back bends away to the sides (``radius_u``) and forward along its height.
    """

    radius_u: float
    radius_v: float

    def __post_init__(self) -> None:
        """Check that the radii are possible."""
        check_size("radius_u", self.radius_u, straight=True)
        check_size("radius_v", self.radius_v, straight=True)

    def point(self, uv: ArrayLike) -> FloatArray:
        """Points (n, 3) m of the surface."""
        u, v = rows_of(uv).T
        return np.column_stack([u, v, v**2 / (2 * self.radius_v) - u**2 / (2 * self.radius_u)])

    def jacobian(self, uv: ArrayLike) -> FloatArray:
        """Derivatives (n, 3, 2) of the points."""
        u, v = rows_of(uv).T
        out = np.tile(np.eye(3)[:, :2], (len(u), 1, 1))
        out[:, 2] = np.column_stack([-u / self.radius_u, v / self.radius_v])
        return out


def _sinc_slope(x: FloatArray) -> FloatArray:
    """(d/dx sin(x)/x)/x, −1/3 at 0."""
    small = np.abs(x) < 1e-2
    safe = np.where(small, 1.0, x)
    exact = (safe * np.cos(safe) - np.sin(safe)) / safe**3
    return np.where(small, -1 / 3 + x**2 / 30 - x**4 / 840, exact)


def rows_of(uv: ArrayLike) -> FloatArray:
    """(n, 2) numbers. Raises GeometryError for another shape."""
    rows = np.asarray(uv, dtype=np.float64)
    if rows.ndim != 2 or rows.shape[1] != 2:
        raise GeometryError(f"expected points (n, 2), got shape {rows.shape}")
    return rows
