"""Solutions that share nothing with the library: series on discs, tubes, rectangles and boxes."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.optimize import brentq
from scipy.special import spherical_jn

from tomoskin.core import FloatArray

Factor = Callable[[FloatArray], FloatArray]
"""(harmonics,) → (harmonics,): the Neumann-to-Dirichlet map as a multiple of that of a disc."""


def disc_resistance(
    radius: float,
    conductivity: float,
    centres: FloatArray,
    half_width: float,
    impedance: FloatArray,
    *,
    factor: Factor = np.ones_like,
    degree: int = 12,
    harmonics: int = 6000,
) -> FloatArray:
    """Transfer resistance (n, n) Ω of a disc with complete electrodes.

    The current density under each electrode is a sum of Legendre polynomials. Its field on the
    rim follows from the Neumann-to-Dirichlet map of the disc, a/(σ n) for the n-th harmonic,
    and u + z j = U is asked for in the mean with each polynomial (Galerkin).

    ``centres`` (n,) and ``half_width`` rad; ``impedance`` (n,) Ω·m. With another ``factor`` the
    sheet is any other that turns into itself around an axis and has a rim of this radius.
    """
    n_el, n_poly = len(centres), degree + 1
    moments = _moments(centres, half_width, degree, harmonics)
    m = np.arange(1.0, harmonics + 1)
    weight = radius**2 * factor(m) / (np.pi * conductivity * m)
    field = ((moments * weight) @ moments.conj().T).real
    norms = np.tile(2.0 / (2.0 * np.arange(n_poly) + 1.0), n_el)
    contact = np.repeat(impedance, n_poly) * norms * half_width * radius
    return _galerkin(field + np.diag(contact), n_poly, 2.0 * half_width * radius)


def inclusion(contrast: float, reach: float) -> Factor:
    """Factor of a concentric inclusion: σ inside over σ outside, radius over the disc's radius."""
    mu = (contrast - 1.0) / (contrast + 1.0)

    def factor(m: FloatArray) -> FloatArray:
        mirrored = mu * reach ** (2.0 * m)
        return np.asarray((1.0 - mirrored) / (1.0 + mirrored))

    return factor


def tube(height: float) -> Factor:
    """Factor of a tube whose other rim is insulated; height over radius."""
    return lambda m: np.asarray(1.0 / np.tanh(m * height))


def _galerkin(system: FloatArray, n_poly: int, size: float) -> FloatArray:
    """Electrode potentials per current: each electrode's first coefficient carries its current."""
    n_el = len(system) // n_poly
    constant = np.zeros((n_el, len(system)))
    constant[np.arange(n_el), np.arange(n_el) * n_poly] = size
    whole = np.block([[system, -constant.T], [constant, np.zeros((n_el, n_el))]])
    rhs = np.zeros((len(whole), n_el))
    rhs[len(system) :] = np.eye(n_el) - 1.0 / n_el
    potentials = np.linalg.solve(whole, rhs)[len(system) :]
    return np.asarray(potentials - potentials.mean(axis=0))


def _moments(centres: FloatArray, half_width: float, degree: int, harmonics: int) -> FloatArray:
    """(n·(degree + 1), harmonics): ∫ P_k e^{−imθ} dθ over each electrode, m = 1, 2, …"""
    m = np.arange(1, harmonics + 1)
    local = _legendre(m, half_width, degree)
    shift = np.exp(-1j * np.outer(centres, m))
    return np.asarray((shift[:, None] * local[None]).reshape(-1, harmonics))


def _legendre(waves: FloatArray, half_width: float, degree: int) -> FloatArray:
    """(degree + 1, n): ∫ P_k(x/w) e^{−iqx} dx from −w to w, for each wave number q."""
    k = np.arange(degree + 1)[:, None]
    return np.asarray(2.0 * half_width * (-1j) ** k * spherical_jn(k, waves * half_width))


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


def box_resistance(
    size: FloatArray,
    conductivity: float,
    centres: FloatArray,
    half_width: float,
    impedance: FloatArray,
    *,
    degree: int = 5,
    waves: int = 240,
) -> FloatArray:
    """Transfer resistance (n, n) Ω of a box with square complete electrodes on its top.

    As on the disc: products of two Legendre polynomials under each electrode, and the
    Neumann-to-Dirichlet map coth(kh)/(σk) of each product of cosines.

    ``size`` (3,) m, the height last; ``centres`` (n, 2) m from a corner; ``impedance`` Ω·m².
    """
    n_poly = degree + 1
    count = np.arange(waves)
    parts = []
    for axis in range(2):
        q = np.pi * count / size[axis]
        turned = np.exp(-1j * np.outer(centres[:, axis], q))
        moment = (turned[:, None] * _legendre(q, half_width, degree)[None]).real
        parts.append(moment / np.sqrt(size[axis] * np.where(count, 0.5, 1.0)))
    moments = np.einsum("eam,ebn->eabmn", *parts).reshape(-1, waves**2)[:, 1:]
    k = np.pi * np.hypot(*np.meshgrid(count / size[0], count / size[1], indexing="ij"))
    k = k.ravel()[1:]
    field = (moments / (conductivity * k * np.tanh(k * size[2]))) @ moments.T
    norm = 2.0 / (2.0 * np.arange(n_poly) + 1.0)
    norms = np.tile(np.outer(norm, norm).ravel(), len(centres))
    contact = np.repeat(impedance, n_poly**2) * norms * half_width**2
    return _galerkin(field + np.diag(contact), n_poly**2, 4.0 * half_width**2)


@dataclass(frozen=True)
class Corner:
    """Rectangle from (0, 0) to (width, height): its left and its lower side are electrodes.

    Products of a cosine in y that meets the lower side's condition and a hyperbolic cosine in x;
    the left side's condition holds for each of them. Nothing ends on a side, so that the field
    is as smooth as a corner lets it be: r² log r.
    """

    width: float
    height: float
    conductivity: float
    left: float
    lower: float
    terms: int = 2000

    @cached_property
    def waves(self) -> FloatArray:
        """(terms,) roots of k tan(k·height) = 1/(zσ), 1/m."""
        h, c = self.height, 1.0 / (self.lower * self.conductivity)

        def condition(x: float) -> float:
            return float(x * np.sin(x) - c * h * np.cos(x))

        roots = [brentq(condition, i * np.pi, (i + 0.5) * np.pi) for i in range(self.terms)]
        return np.array(roots) / h

    @cached_property
    def shares(self) -> FloatArray:
        """(terms,) coefficient of each product, scaled to 1 at x = 0, for 1 V."""
        k, h = self.waves, self.height
        mean = np.sin(k * h) / k
        square = h / 2 + np.sin(2 * k * h) / (4 * k)
        return np.asarray(mean / square / (1 + self._drop))

    @cached_property
    def _drop(self) -> FloatArray:
        k = self.waves
        return np.asarray(self.left * self.conductivity * k * np.tanh(k * self.width))

    @cached_property
    def resistance(self) -> float:
        """Ω between the two electrodes (times the depth of a box)."""
        k = self.waves
        current = self.shares * np.tanh(k * self.width) * np.sin(k * self.height)
        return float(1.0 / (self.conductivity * current.sum()))

    def field(self, x: FloatArray, y: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Potential (n,) and gradient (n, 2) of 1 A from left to lower, which is at zero."""
        k = self.waves[:, None]
        away, edge = k * (self.width - x), k * self.width
        scale = self.resistance * self.shares[:, None] / (1 + np.exp(-2 * edge))
        cosh = scale * (np.exp(away - edge) + np.exp(-away - edge))
        sinh = scale * (np.exp(away - edge) - np.exp(-away - edge))
        across = np.cos(k * (self.height - y)), np.sin(k * (self.height - y))
        slope = np.stack([-(k * sinh * across[0]).sum(0), (k * cosh * across[1]).sum(0)], axis=1)
        return (cosh * across[0]).sum(0), slope
