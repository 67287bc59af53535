"""Facets, neighbours and sizes of simplices, from bare arrays."""

from __future__ import annotations

import math

import numpy as np

from tomoskin.core import FloatArray, IntArray


def simplex_measure(points: FloatArray, simplices: IntArray) -> FloatArray:
    """Length (m), area (m²) or volume (m³) of each simplex, (n,), from its Gram determinant."""
    corner = points[simplices]
    edges = corner[:, 1:] - corner[:, :1]
    gram = np.einsum("nid,njd->nij", edges, edges)
    k = edges.shape[1]
    return np.asarray(np.sqrt(np.maximum(np.linalg.det(gram), 0.0)) / math.factorial(k))


def facets(cells: IntArray) -> tuple[IntArray, IntArray]:
    """All facets with sorted corners, (n_cells·k, k − 1), and the cell that owns each."""
    k = cells.shape[1]
    corners = [[c for c in range(k) if c != left_out] for left_out in range(k)]
    facet = np.sort(np.concatenate([cells[:, c] for c in corners]), axis=1)
    return facet, np.tile(np.arange(len(cells)), k)


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
