"""What a solve returns."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from numpy.typing import NDArray

if TYPE_CHECKING:
    from tomoskin.forward.state import State


@dataclass(frozen=True, eq=False)
class Solution:
    """Potentials and voltages for one conductivity; complex where σ or z is.

    What is more than the voltages is computed when it is asked for, once.
    """

    state: State

    @property
    def voltages(self) -> NDArray[Any]:
        """(n_meas,) V, in the pattern's order."""
        return self.state.voltages

    @property
    def electrode_potentials(self) -> NDArray[Any]:
        """(n_drive, n_electrodes) V; each row sums to zero, which fixes the free constant."""
        return self.state.electrode_potentials

    @property
    def potentials(self) -> NDArray[Any]:
        """(n_drive, n_points) V at the mesh's points."""
        return self.state.potentials

    @property
    def power(self) -> NDArray[Any]:
        """(n_drive, n_cells) W: power turned to heat in each cell, its real part."""
        return self.state.power

    @property
    def residual(self) -> float:
        """Largest relative residual of the linear solves."""
        return self.state.residual
