"""What spots do to each other: the change by all of them beyond that by each alone.

One spot scatters the field that another one has scattered. To second order that is
−FₐᵀΓₐᵦFᵦ and its transpose: F is the field of each electrode times what a spot changes, Γ the
field in one patch of the sheet by a dipole in another. Each in patches a few cells large, in which
a field counts as even. A spot's own reaction is in the logarithm of its conductivity: for a round
one that is exact to second order (Maxwell 1873, article 314, in the plane).
"""

from __future__ import annotations

import math
from collections.abc import Generator
from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array, vstack
from scipy.spatial import cKDTree

from tomoskin.core import FloatArray, IntArray
from tomoskin.model.forward import State
from tomoskin.sensing.fit.spot import CONTENT, FILLING, LOG_RADIUS, REACH, Response, profile

_PATCHES = 120
"""Of the sheet, about."""

_ABREAST = 128
"""Columns of the inverse that are held at a time."""


@dataclass(frozen=True, eq=False)
class Interaction:
    """The fields in patches of a sheet.

    Attributes
    ----------
    state
        Of the sheet.
    centres
        (p, 2) m of the patches.
    spread
        m², the mean second moment of a patch: it is added to a spot's.
    fields
        (p, 2, n_electrodes) of 1 A into each electrode, scaled by √(area · conductivity).
    between
        (2p, 2p) of dipoles in all patches, in the same measure; patch by patch. Both in single
        precision: they are read through in a frame.
    """

    state: State
    centres: FloatArray
    spread: float
    fields: NDArray[np.float32]
    between: NDArray[np.float32]

    @classmethod
    def making(cls, response: Response) -> Generator[None, None, Self]:
        """Some ten milliseconds of work for a mesh of 1,500 cells, a piece between two yields."""
        state = response.state
        mesh, sigma = state.model.mesh, np.asarray(state.conductivity)
        patch, centres, area = _patches(mesh.centroids, mesh.volumes)
        n, part = len(sigma), np.sqrt(mesh.volumes / area[patch])
        mean = csr_array((part, (patch, np.arange(n))), shape=(len(area), n))
        root = np.sqrt(mean.power(2) @ sigma)
        gradient = state.model.gradient
        across = vstack([mean @ gradient[:n], mean @ gradient[n:]]).tocsr()
        carried = yield from _carried(state, across)
        yield
        between = carried.reshape(2, len(area), 2, len(area)).transpose(1, 0, 3, 2)
        between = between * root[:, None, None, None] * root[:, None]
        fields = np.stack([(mean @ state.gradient[:, axis].T) for axis in (0, 1)], axis=1)
        spread = 4 * float(area.mean()) / 12
        shape = 2 * len(area), 2 * len(area)
        return cls(
            state,
            centres,
            spread,
            (root[:, None, None] * fields).astype(np.float32),
            between.reshape(shape).astype(np.float32),
        )

    def change(self, spots: FloatArray) -> FloatArray:
        """(n_meas,) V of spots (k, 4) together, less what each does alone."""
        heights, n = self._heights(spots).astype(np.float32), self.fields.shape[2]
        total = np.zeros((n, n), np.float32)
        before: list[tuple[IntArray, NDArray[np.float32]]] = []
        for height in heights:
            own = np.flatnonzero(height)  # few: beyond a spot's reach there is nothing to multiply
            scattered = (height[own, None, None] * self.fields[own]).reshape(-1, n)
            axes = np.add.outer(2 * own, (0, 1)).ravel()
            for others, earlier in before:
                total += earlier.T @ (self.between[others[:, None], axes] @ scattered)
            before.append((axes, scattered))
        return self.state.model.voltages(total + total.T)

    def _heights(self, spots: FloatArray) -> FloatArray:
        """(k, p) change of the logarithm of the conductivity of each patch by each spot."""
        square = np.exp(2 * spots[:, LOG_RADIUS]) + self.spread
        away = self.centres - spots[:, None, :2]
        far = np.einsum("kpd,kpd->kp", away, away) / (REACH**2 * square[:, None])
        return profile(far) * (spots[:, CONTENT] / (FILLING * square))[:, None]


def _patches(centroids: FloatArray, volumes: FloatArray) -> tuple[IntArray, FloatArray, FloatArray]:
    """(n_cells,) the patch of each cell; (p, 2) m and (p,) m²: their centres and areas."""
    step = math.sqrt(float(volumes.sum()) / _PATCHES)
    low, high = centroids.min(axis=0), centroids.max(axis=0)
    x, y = np.meshgrid(*(np.arange(a, b + step, step) for a, b in zip(low, high, strict=True)))
    x[1::2] += step / 2
    _, nearest = cKDTree(np.column_stack([x.ravel(), y.ravel()])).query(centroids)
    _, inverse = np.unique(nearest, return_inverse=True)
    patch = np.asarray(inverse, dtype=np.int64)
    area = np.asarray(np.bincount(patch, volumes), dtype=np.float64)
    sums = [np.bincount(patch, volumes * column) for column in centroids.T]
    return patch, np.stack(sums, axis=1) / area[:, None], area


def _carried(state: State, across: csr_array) -> Generator[None, None, FloatArray]:
    """(m, m): ``across`` (m, n_nodes) on both sides of the inverse of the sheet's matrix."""
    n_nodes = across.shape[1]
    through = np.empty(across.shape)
    for first in range(0, n_nodes, _ABREAST):
        yield
        nodes = np.arange(first, min(first + _ABREAST, n_nodes))
        through[:, nodes] = across @ state.factor.columns(nodes)[:n_nodes]
    yield
    return np.asarray(across @ through.T)
