"""Facets, neighbours and sizes of simplices, from bare arrays."""

from __future__ import annotations

import math

import numpy as np

from tomoskin.core import FloatArray, IntArray


def simplex_measure(points: FloatArray, simplices: IntArray) -> FloatArray:
    """Length (m), area (m²) or volume (m³) of each simplex, (n,), in the plane or in space."""
    corner = points[simplices]
    edges = (corner[:, 1:] - corner[:, :1]).transpose(1, 2, 0)
    return np.abs(_content(edges)) / math.factorial(len(edges))


def _content(edges: FloatArray) -> FloatArray:
    """(n,) of what ``edges`` (k, d, n) span: a Gram determinant would lose half the digits."""
    if len(edges) == 1:
        return np.asarray(np.linalg.norm(edges[0], axis=0))
    u, v = edges[:2]
    if edges.shape[1] == 2:
        return np.asarray(u[0] * v[1] - u[1] * v[0])
    normal = np.cross(u, v, axis=0)
    if len(edges) == 2:
        return np.asarray(np.linalg.norm(normal, axis=0))
    return np.asarray((normal * edges[2]).sum(axis=0))


def facets(cells: IntArray) -> tuple[IntArray, IntArray]:
    """All facets with sorted corners, (n_cells·k, k − 1), and the cell that owns each."""
    k = cells.shape[1]
    corners = [[c for c in range(k) if c != opposite] for opposite in range(k)]
    facet = np.sort(np.concatenate([cells[:, c] for c in corners]), axis=1)
    return facet, np.tile(np.arange(len(cells)), k)


def owners(cells: IntArray, wanted: IntArray) -> IntArray:
    """(n,) a cell that each facet of ``wanted`` (n, k − 1) belongs to, by its corners."""
    facet, owner = facets(cells)
    both = np.concatenate([facet, np.sort(wanted, axis=1)])
    number = np.unique(both, axis=0, return_inverse=True)[1].reshape(-1)
    of = np.empty(number.max() + 1, dtype=np.int64)
    of[number[: len(facet)]] = owner
    return np.asarray(of[number[len(facet) :]])


def neighbour_pairs(cells: IntArray) -> IntArray:
    """(n_pairs, 2) cells that share a facet, each pair once."""
    return paired_facets(cells)[0]


def boundary_facets(cells: IntArray) -> IntArray:
    """(n_facets, k − 1) facets that belong to one cell only, corners sorted."""
    return paired_facets(cells)[1]


def paired_facets(cells: IntArray) -> tuple[IntArray, IntArray]:
    """:func:`neighbour_pairs` and :func:`boundary_facets`, from one sort."""
    facet, owner = facets(cells)
    order = np.lexsort(facet.T[::-1])
    facet, owner = facet[order], owner[order]
    same = (facet[1:] == facet[:-1]).all(axis=1)
    single = ~(np.append(same, False) | np.append(False, same))
    return np.column_stack([owner[:-1][same], owner[1:][same]]), np.asarray(facet[single])
