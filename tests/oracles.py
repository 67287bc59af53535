"""Solutions that share nothing with the library: series on a homogeneous disc."""

from __future__ import annotations

import numpy as np
from scipy.special import spherical_jn

from tomoskin.core import FloatArray


def disc_resistance(
    radius: float,
    conductivity: float,
    centres: FloatArray,
    half_width: float,
    impedance: FloatArray,
    *,
    degree: int = 12,
    harmonics: int = 6000,
) -> FloatArray:
    """Transfer resistance (n, n) Ω of a disc with complete electrodes.

    The current density under each electrode is a sum of Legendre polynomials. Its field on the
    rim follows from the Neumann-to-Dirichlet map of the disc, a/(σ n) for the n-th harmonic,
    and u + z j = U is asked for in the mean with each polynomial (Galerkin).

    ``centres`` (n,) and ``half_width`` rad; ``impedance`` (n,) Ω·m.
    """
    n_el, n_poly = len(centres), degree + 1
    moments = _moments(centres, half_width, degree, harmonics)
    weight = radius**2 / (np.pi * conductivity * np.arange(1, harmonics + 1))
    field = ((moments * weight) @ moments.conj().T).real
    norms = np.tile(2.0 / (2.0 * np.arange(n_poly) + 1.0), n_el)
    contact = np.repeat(impedance, n_poly) * norms * half_width * radius
    constant = np.zeros((n_el, n_el * n_poly))
    constant[np.arange(n_el), np.arange(n_el) * n_poly] = 2.0 * half_width * radius
    size = n_el * n_poly
    system = np.zeros((size + n_el, size + n_el))
    system[:size, :size] = field + np.diag(contact)
    system[:size, size:] = -constant.T
    system[size:, :size] = constant
    rhs = np.zeros((len(system), n_el))
    rhs[size:] = np.eye(n_el) - 1.0 / n_el
    potentials = np.linalg.solve(system, rhs)[size:]
    return np.asarray(potentials - potentials.mean(axis=0))


def _moments(centres: FloatArray, half_width: float, degree: int, harmonics: int) -> FloatArray:
    """(n·(degree + 1), harmonics): ∫ P_k e^{−imθ} dθ over each electrode, m = 1, 2, …"""
    m = np.arange(1, harmonics + 1)
    k = np.arange(degree + 1)
    local = 2.0 * half_width * (-1j) ** k[:, None] * spherical_jn(k[:, None], m * half_width)
    shift = np.exp(-1j * np.outer(centres, m))
    return np.asarray((shift[:, None] * local[None]).reshape(-1, harmonics))


def disc_points(
    conductivity: float, source: FloatArray, sink: FloatArray, where: FloatArray
) -> FloatArray:
    """Potential (n,) V at ``where`` (n, 2) of 1 A between two points of a disc's rim, (2,) each.

    The image of a rim point is the point itself, so the field is that of a line source twice as
    strong; the constant makes the potential zero midway between the two.
    """
    near = np.linalg.norm(where - source, axis=1)
    far = np.linalg.norm(where - sink, axis=1)
    return np.asarray(np.log(far / near) / (np.pi * conductivity))
