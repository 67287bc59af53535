"""A Gaussian random field on a mesh, by its strongest modes."""

from __future__ import annotations

import numpy as np

from tomoskin.core import FloatArray
from tomoskin.model.mesh import Mesh

_NODES = 260
"""Cells that carry a field; the others follow from them (Nyström's method)."""

_MODES = 60


def field_modes(mesh: Mesh, length: float) -> FloatArray:
    """(n_cells, k): modes of a field of unit variance, each as long as its standard deviation.

    Its correlation is exp(−d²/2 ``length``²), length in m, in the sheet's flat coordinates
    (Rasmussen & Williams 2006, equations 4.9 and 8.1).
    """
    points = mesh.centroids
    nodes = points[:: max(1, len(points) // _NODES)]
    size, vector = np.linalg.eigh(_correlation(nodes, nodes, length))
    kept = np.flatnonzero(size > 1e-6 * size[-1])[-_MODES:]
    return np.asarray(_correlation(points, nodes, length) @ (vector[:, kept] / np.sqrt(size[kept])))


def _correlation(one: FloatArray, other: FloatArray, length: float) -> FloatArray:
    square = ((one[:, None] - other) ** 2).sum(axis=2)
    return np.asarray(np.exp(-square / (2 * length**2)))
