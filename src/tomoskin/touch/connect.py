"""Connected regions of cells on a mesh, fast for the few cells of a touch."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tomoskin.core import IntArray
from tomoskin.mesh import Mesh


def neighbour_table(mesh: Mesh) -> IntArray:
    """(n_cells, k) cells that share a facet with each cell; −1 where there are fewer."""
    first, second = mesh.neighbours.T
    cell, other = np.concatenate([first, second]), np.concatenate([second, first])
    order = np.argsort(cell, kind="stable")
    cell, other = cell[order], other[order]
    count = np.bincount(cell, minlength=len(mesh.cells))
    place = np.arange(len(cell)) - np.repeat(np.cumsum(count) - count, count)
    table = np.full((len(mesh.cells), mesh.cells.shape[1]), -1)
    table[cell, place] = other
    return table


def connected(kept: IntArray, positive: NDArray[np.bool_], neighbours: IntArray) -> IntArray:
    """(n_kept,) label of each of the ``kept`` cells; equal where they are connected.

    Two neighbours are connected when both are kept and have the same sign (``positive``, per
    cell of the mesh). Each cell takes the least label around it, then the label of that label:
    the number of rounds grows with the logarithm of a region's size.
    """
    n = len(kept)
    place = np.full(len(neighbours) + 1, n)
    place[kept] = np.arange(n)
    around = neighbours[kept].T
    around_place = place[around]
    around_place[positive[around] != positive[kept]] = n
    label = np.arange(n + 1)
    while True:
        least = label[:n].copy()
        for column in around_place:
            np.minimum(least, label[column], out=least)
        least = least[least]
        if (least == label[:n]).all():
            return least
        label[:n] = least
