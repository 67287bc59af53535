"""What may be given as a conductivity."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tomoskin.core import ModelError
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
    raw = numbers(value, "conductivity")
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
        _refuse_first(bad, sigma, "a positive finite conductivity")
    return sigma


def numbers(value: ArrayLike, name: str) -> NDArray[Any]:
    """``value`` as an array of numbers.

    Raises
    ------
    ModelError
        For anything else: text, nothing, rows of unequal length.
    """
    try:
        raw = np.asarray(value)
    except ValueError as error:
        raise ModelError(
            f"expected rows of equal length as {name}, got different lengths"
        ) from error
    if raw.dtype.kind not in "biufc":
        raise ModelError(f"expected numbers as {name}, got {raw.dtype}")
    return raw


def number_type(raw: NDArray[Any]) -> type[np.floating[Any] | np.complexfloating[Any, Any]]:
    """complex128 for complex input, else float64."""
    return np.complex128 if np.iscomplexobj(raw) else np.float64


def _checked_tensor(sigma: NDArray[Any], mesh: Mesh) -> NDArray[Any]:
    _refuse_first(~np.isfinite(sigma).all(axis=(1, 2)), sigma, "a finite conductivity")
    skew = np.abs(sigma - sigma.swapaxes(1, 2)).max(axis=(1, 2))
    _refuse_first(
        skew > _SYMMETRY * np.abs(sigma).max(axis=(1, 2)), sigma, "a symmetric conductivity tensor"
    )
    principal = np.linalg.eigvalsh(_in_sheet(sigma.real, mesh))
    _refuse_first(
        principal[:, 0] <= _DEFINITE * np.abs(principal[:, -1]),
        sigma,
        "a conductivity tensor that is positive definite",
    )
    return sigma


def _in_sheet(sigma: NDArray[Any], mesh: Mesh) -> NDArray[Any]:
    """Each tensor in an orthonormal basis of its cell."""
    corner = mesh.corners
    basis, _ = np.linalg.qr((corner[:, 1:] - corner[:, :1]).swapaxes(1, 2))
    return np.asarray(basis.swapaxes(1, 2) @ sigma @ basis)


def _refuse_first(bad: NDArray[np.bool_], sigma: NDArray[Any], expected: str) -> None:
    if bad.any():
        cell = int(np.argmax(bad))
        raise ModelError(f"expected {expected}, got {sigma[cell].tolist()}", where=f"cell {cell}")
