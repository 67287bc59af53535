"""What may be given: a conductivity, and touches, cells and what they change to."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike, DTypeLike, NDArray

from tomoskin.core import IntArray, ModelError, numeric, refuse_first
from tomoskin.model.mesh import Mesh

_SYMMETRY = 1e-10
_DEFINITE = 1e-14
"""A tensor whose least eigenvalue is this far below its largest is singular but for rounding."""


def checked_conductivity(value: ArrayLike, mesh: Mesh) -> NDArray[Any]:
    """(n_cells,) or (n_cells, d, d), real or complex, with a positive real part.

    Raises
    ------
    ModelError
        For another shape, or naming the first cell whose conductivity is not positive, not
        finite or (a tensor) not symmetric. On a curved sheet a tensor acts in the sheet only, and
        must be positive there; with a metric it is in each cell's frame (``Mesh.corners``).
    """
    raw = numeric(value, ModelError, " as conductivity")
    n, d = len(mesh.cells), mesh.points.shape[1]
    if raw.shape not in ((), (n,), (n, d, d)):
        raise ModelError(
            f"expected conductivity of shape ({n},) or ({n}, {d}, {d}), got {raw.shape}"
        )
    sigma = raw.astype(number_type(raw))
    if sigma.ndim == 3:
        return _checked_tensor(sigma, mesh)
    if sigma.ndim == 0:
        sigma = np.full(n, sigma)
    if not (sigma.real.min(initial=1.0) > 0 and np.isfinite(sigma).all()):
        bad = ~(np.isfinite(sigma) & (sigma.real > 0))
        refuse_first(bad, sigma, "a positive finite conductivity", "cell", ModelError)
    return sigma


def number_type(raw: NDArray[Any]) -> type[np.floating[Any] | np.complexfloating[Any, Any]]:
    """complex128 for complex input, else float64."""
    return np.complex128 if np.iscomplexobj(raw) else np.float64


def _checked_tensor(sigma: NDArray[Any], mesh: Mesh) -> NDArray[Any]:
    infinite = ~np.isfinite(sigma).all(axis=(1, 2))
    refuse_first(infinite, sigma, "a finite conductivity", "cell", ModelError)
    skew = np.abs(sigma - sigma.swapaxes(1, 2)).max(axis=(1, 2))
    skewed = skew > _SYMMETRY * np.abs(sigma).max(axis=(1, 2))
    refuse_first(skewed, sigma, "a symmetric conductivity tensor", "cell", ModelError)
    principal = np.linalg.eigvalsh(_in_sheet(sigma.real, mesh))
    indefinite = principal[:, 0] <= _DEFINITE * np.abs(principal[:, -1])
    positive = "a conductivity tensor that is positive definite"
    refuse_first(indefinite, sigma, positive, "cell", ModelError)
    return sigma


def _in_sheet(sigma: NDArray[Any], mesh: Mesh) -> NDArray[Any]:
    """Each tensor in an orthonormal basis of its cell."""
    corner = mesh.corners
    basis, _ = np.linalg.qr((corner[:, 1:] - corner[:, :1]).swapaxes(1, 2))
    return np.asarray(basis.swapaxes(1, 2) @ sigma @ basis)


Touch = tuple[ArrayLike, ArrayLike]
"""Cells (n,), and the conductivity (n,) of each."""


@dataclass(frozen=True, eq=False)
class Touches:
    """Touches one behind the other: number t has ``cells[starts[t]:starts[t + 1]]``."""

    starts: IntArray
    cells: IntArray
    conductivity: NDArray[Any]

    @classmethod
    def of(cls, touches: Sequence[Touch], dtype: DTypeLike) -> Self:
        """Join touches; conductivities get ``dtype`` unless one of them is complex.

        Raises
        ------
        ModelError
            For cells that are no whole numbers, or not as many conductivities.
        """
        pairs = [_arrays(*touch) for touch in touches]
        if len(pairs) == 1:
            cells, sigma = pairs[0]
            starts = np.array([0, len(cells)])
        else:
            starts = np.cumsum([0, *(len(cells) for cells, _ in pairs)])
            cells = np.concatenate([cells for cells, _ in pairs] or [starts[:0]])
            sigma = np.concatenate([sigma for _, sigma in pairs] or [np.empty(0)])
        kind = np.complex128 if sigma.dtype.kind == "c" else dtype
        return cls(starts, np.ascontiguousarray(cells, np.int64), np.ascontiguousarray(sigma, kind))

    def __len__(self) -> int:
        """The number of touches in the stack."""
        return len(self.starts) - 1

    def __getitem__(self, number: int) -> tuple[IntArray, NDArray[Any]]:
        """Cells and conductivities of one touch."""
        within = slice(self.starts[number], self.starts[number + 1])
        return self.cells[within], self.conductivity[within]

    def part(self, first: int, end: int) -> Touches:
        """Touches from ``first`` on, before ``end``."""
        starts = self.starts[first : end + 1]
        within = slice(starts[0], starts[-1])
        return Touches(starts - starts[0], self.cells[within], self.conductivity[within])

    def check(self, n_cells: int) -> None:
        """Raise ModelError for a wrong cell or conductivity, on a mesh of ``n_cells``."""
        for number in range(len(self)):
            cells, sigma = self[number]
            order = np.sort(cells)
            for bad, message, values in (
                ((cells < 0) | (cells >= n_cells), f"cells from 0 to {n_cells - 1}", cells),
                (~(np.isfinite(sigma) & (sigma.real > 0)), "a positive finite conductivity", sigma),
                (np.isin(cells, order[1:][order[1:] == order[:-1]]), "each cell once", cells),
            ):
                if bad.any():
                    first = int(np.argmax(bad))
                    touch = f"touch {number}, " if len(self) > 1 else ""
                    where = f"{touch}cell {cells[first]}"
                    raise ModelError(f"expected {message}, got {values[first]}", where=where)


def _arrays(cells: ArrayLike, conductivity: ArrayLike) -> tuple[IntArray, NDArray[Any]]:
    index = numeric(cells, ModelError, " as cells")
    sigma = numeric(conductivity, ModelError, " as conductivity")
    if not index.size:
        index = index.astype(np.int64)
    if index.dtype.kind not in "iu" or index.ndim != 1 or sigma.shape != index.shape:
        raise ModelError(
            f"expected cells (n,) and as many conductivities, got {index.shape} "
            f"{index.dtype} and {sigma.shape}"
        )
    return index, sigma
