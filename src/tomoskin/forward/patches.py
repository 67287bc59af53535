"""What the two engines of the local update are given, and what is asked of them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from tomoskin.core import FloatArray, IntArray


@dataclass(frozen=True, eq=False)
class BaseState:
    """A state that touches change.

    Attributes
    ----------
    cells
        (n_cells, k) nodes.
    local
        (n_cells, k, k) matrix of each cell for a conductivity of one.
    held
        (n_nodes,) whether a node belongs to an electrode.
    conductivity
        (n_cells,) S or S/m.
    fields
        (n_nodes, width) V/A of 1 A into each electrode but the last.
    grounded
        (width, width) Ω, their potentials at these electrodes.
    """

    cells: IntArray
    local: FloatArray
    held: NDArray[np.bool_]
    conductivity: NDArray[Any]
    fields: NDArray[Any]
    grounded: NDArray[Any]


class Patches(Protocol):
    """Changes of a base state by touches."""

    def keep(self, nodes: IntArray, columns: NDArray[Any]) -> None:
        """Store columns (n_nodes, n) of the base system's inverse, those of ``nodes`` (n,)."""
        ...

    def forget(self) -> None:
        """Drop all that were stored."""
        ...

    def change(
        self, starts: IntArray, cells: IntArray, conductivity: NDArray[Any]
    ) -> tuple[NDArray[Any], NDArray[Any], IntArray]:
        """Results of touches, of which number t has ``cells[starts[t]:starts[t + 1]]``.

        Returns
        -------
        grounded
            (n_touches, width, width) Ω.
        lost
            (n_touches, width, width) Ω, how far rounding may have shifted them.
        missing
            Nodes whose columns must be stored first; unless empty, nothing else counts.

        Raises
        ------
        ValueError
            For a cell that does not exist or stands twice in a touch, a conductivity that is not
            positive, or a singular system.
        """
        ...
