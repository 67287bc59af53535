"""How a dent and a drag stretch the sheet in its own plane."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.fft import irfft2, rfft2

from tomoskin.core import FloatArray
from tomoskin.twin.contact import ContactSettings, Grid

_Waves = NDArray[np.complex128]


def slope_strain(depth: FloatArray, settings: ContactSettings, grid: Grid) -> FloatArray:
    """(3, n, n) strain xx, yy, xy of a sheet that follows a dent: ½∇w∇wᵀ and what it evens out.

    The sheet's plane stress C(ε(u) + ½∇w∇wᵀ) is in balance with the shear of the body below,
    ∇·C(…) = κu (von Kármán's membrane on shear springs κ; Timoshenko & Woinowsky-Krieger 1959,
    chapter 13). Quadratic in the depth.
    """
    qx, qy = grid.wave_numbers
    waves = rfft2(depth)
    wx, wy = (irfft2(1j * q * waves, depth.shape) for q in (qx, qy))
    own = [rfft2(part) for part in (wx * wx / 2, wy * wy / 2, wx * wy / 2)]
    lame, shear = _lame(settings)
    trace = lame * (own[0] + own[1])
    push_x = 1j * (qx * (trace + 2 * shear * own[0]) + qy * 2 * shear * own[2])
    push_y = 1j * (qx * 2 * shear * own[2] + qy * (trace + 2 * shear * own[1]))
    moved = _strain(*_shift(push_x, push_y, settings, grid), grid)
    return np.stack([irfft2(a + b, depth.shape) for a, b in zip(own, moved, strict=True)])


def bulge_strain(depth: FloatArray, settings: ContactSettings, grid: Grid) -> FloatArray:
    """(3, n, n) strain xx, yy, xy of a sheet that the body's face carries along as it bulges.

    Pressed by w, the body of thickness t would spread by β w/t in each direction; its face moves
    by the gradient field with that divergence, and drags the sheet through its shear springs.
    Linear in the depth.
    """
    qx, qy = grid.wave_numbers
    squared = qx**2 + qy**2
    squared[0, 0] = 1.0
    spread = 2 * settings.bulge / settings.thickness * rfft2(depth) / squared
    pull = [-1j * q * spread * settings.shear_spring for q in (qx, qy)]
    waves = _strain(*_shift(pull[0], pull[1], settings, grid), grid)
    for part in waves[:2]:
        part[0, 0] = spread[0, 0] / 2  # free to spread: no grid around it holds it back
    return np.stack([irfft2(part, depth.shape) for part in waves])


def drag_strain(traction: FloatArray, settings: ContactSettings, grid: Grid) -> FloatArray:
    """(3, n, n) strain xx, yy, xy under a ``traction`` (2, n, n) Pa along the sheet; linear."""
    shape = traction.shape[1:]
    waves = _strain(*_shift(rfft2(traction[0]), rfft2(traction[1]), settings, grid), grid)
    return np.stack([irfft2(part, shape) for part in waves])


def _shift(fx: _Waves, fy: _Waves, settings: ContactSettings, grid: Grid) -> tuple[_Waves, _Waves]:
    """Displacement that balances a load along the sheet: (κ + μq²) u + (λ + μ) q(q·u) = f."""
    qx, qy = grid.wave_numbers
    lame, shear = _lame(settings)
    squared = qx**2 + qy**2
    plain = settings.shear_spring + shear * squared
    along = (lame + shear) * (qx * fx + qy * fy) / (plain + (lame + shear) * squared)
    return (fx - qx * along) / plain, (fy - qy * along) / plain


def _strain(ux: _Waves, uy: _Waves, grid: Grid) -> tuple[_Waves, _Waves, _Waves]:
    qx, qy = grid.wave_numbers
    return 1j * qx * ux, 1j * qy * uy, 0.5j * (qx * uy + qy * ux)


def _lame(settings: ContactSettings) -> tuple[float, float]:
    """λ and μ of plane stress, N/m."""
    nu = settings.sheet_poisson
    shear = settings.stiffness / (2 * (1 + nu))
    return settings.stiffness * nu / (1 - nu**2), shear
