"""What a solve returns."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from numpy.typing import NDArray


@dataclass(frozen=True, eq=False)
class Solution:
    """Potentials and voltages for one conductivity; complex where σ or z is.

    Attributes
    ----------
    voltages
        (n_meas,) V, in the pattern's order.
    electrode_potentials
        (n_drive, n_electrodes) V; each row sums to zero, which fixes the free constant.
    potentials
        (n_drive, n_points) V at the mesh's points.
    residual
        Largest relative residual of the linear solves.
    """

    voltages: NDArray[Any]
    electrode_potentials: NDArray[Any]
    potentials: NDArray[Any]
    residual: float
