"""The complete electrode model on plane triangles with sixty digits: no contrast is too large."""

from __future__ import annotations

from decimal import Decimal, localcontext
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tomoskin.core import FloatArray
from tomoskin.model.mesh import Mesh
from tomoskin.model.pattern import Pattern

DIGITS = 60


def voltages(mesh: Mesh, pattern: Pattern, sigma: ArrayLike, impedance: ArrayLike) -> FloatArray:
    """(n_meas,) V of 1 A in each drive, rounded once, at the very end."""
    with localcontext() as context:
        context.prec = DIGITS
        r = _grounded(mesh, _exact(sigma), _exact(impedance))
        (source, sink), (plus, minus) = pattern.drive.T, pattern.measure.T
        exact = r[plus, source] - r[plus, sink] - r[minus, source] + r[minus, sink]
        return np.asarray(exact.astype(np.float64))


def _exact(values: ArrayLike) -> NDArray[Any]:
    return np.vectorize(lambda x: Decimal(float(x)), otypes=[object])(values)


def _zeros(*shape: int) -> NDArray[Any]:
    return np.full(shape, Decimal(0), dtype=object)


def _grounded(mesh: Mesh, sigma: NDArray[Any], impedance: NDArray[Any]) -> NDArray[Any]:
    """Potentials of the electrodes against the last one, per ampere into each."""
    points, n = _exact(mesh.points), len(mesh.points)
    n_el = len(mesh.electrodes)
    system = _zeros(n + n_el, n + n_el)
    for cell, conductivity in zip(mesh.cells, sigma, strict=True):
        side = np.roll(points[cell], -1, axis=0) - np.roll(points[cell], -2, axis=0)
        twice = abs(side[0, 0] * side[1, 1] - side[0, 1] * side[1, 0])
        system[np.ix_(cell, cell)] += conductivity * (side @ side.T) / (2 * twice)
    form = _exact([[2, 1, -3], [1, 2, -3], [-3, -3, 6]]) / 6
    for number, facets in enumerate(mesh.electrodes):
        for a, b in facets:
            step = points[a] - points[b]
            place = [a, b, n + number]
            system[np.ix_(place, place)] += (step @ step).sqrt() / impedance[number] * form
    rhs = _zeros(n + n_el - 1, n_el - 1)
    rhs[n + np.arange(n_el - 1), np.arange(n_el - 1)] = Decimal(1)
    out = _zeros(n_el, n_el)
    out[:-1, :-1] = _solved(system[:-1, :-1], rhs)[n:]
    return out


def _solved(system: NDArray[Any], rhs: NDArray[Any]) -> NDArray[Any]:
    """Gauss, without pivots as the matrix is positive definite."""
    for k in range(len(system)):
        weight = system[k + 1 :, k] / system[k, k]
        below = np.flatnonzero(weight)
        system[k + 1 + below, k:] -= np.outer(weight[below], system[k, k:])
        rhs[k + 1 + below] -= np.outer(weight[below], rhs[k])
    for k in reversed(range(len(system))):
        rhs[k] = (rhs[k] - system[k, k + 1 :] @ rhs[k + 1 :]) / system[k, k]
    return rhs
