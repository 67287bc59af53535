"""A sheet as its reference tells of it: uneven, and conducting otherwise along than across.

The logarithm of the conductivity is a Gaussian random field. How uneven it is, over which lengths,
and how well rows follow the model is what makes the reference likeliest (evidence: MacKay 2003,
chapter 28); the field itself is the most likely one then (Gauss–Newton).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import product
from typing import Self

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import LinAlgError, cho_factor, cho_solve

from tomoskin.core import FloatArray, reach
from tomoskin.forward import ForwardModel, State
from tomoskin.touch.fit.anisotropy import anisotropy_slopes, directed
from tomoskin.touch.fit.channels import channel_errors
from tomoskin.touch.fit.random_field import field_modes

_UNEVEN = (0.0, 0.01, 0.03, 0.06, 0.12, 0.24)
"""Standard deviations of log σ over a sheet that are compared."""

_LENGTHS = (0.15, 0.3)
"""Correlation lengths that are compared, in parts of √area."""

_ERRORS = (0.003, 0.01, 0.03, 0.1, 0.3)
"""Standard deviations of rows about the model, in parts of them, that are compared: meshes,
positions of electrodes, wires."""

_DIRECTED = 0.2
"""Standard deviation of the two numbers of an anisotropy."""

_LEAST = 0.03
"""Size of an anisotropy below which an even sheet counts as isotropic."""

_WILD = 2.0
"""A row that is by more than this factor off its part of all is broken, and does not count."""

_STEPS = 3


@dataclass(frozen=True, eq=False)
class _Measured:
    """A reference (n_meas,) V, its standard deviation (n_meas,) V, and (n,) rows that count."""

    values: FloatArray
    deviation: FloatArray
    rows: NDArray[np.intp]

    @classmethod
    def of(cls, state: State, values: FloatArray, deviation: FloatArray | float) -> Self:
        finite = np.isfinite(values)
        ratio = np.where(finite, values, np.nan) / state.voltages
        middle = np.nanmedian(ratio) if finite.any() else np.nan
        with np.errstate(invalid="ignore"):
            usual = finite & (ratio / middle > 1 / _WILD) & (ratio / middle < _WILD)
        return cls(values, np.broadcast_to(deviation, values.shape), np.flatnonzero(usual))


@dataclass(frozen=True, eq=False)
class _Linear:
    """The rows that count, linear about a sheet.

    ``residual`` (n,) V less the model's; ``by_cell`` (n, n_cells) V by log σ; ``along`` (n, 2) V,
    what one deviation of an anisotropy does; ``common`` (n, n) V², covariance of what the channels
    and a common factor do, and of the noise; ``size`` (n,) V of the model.
    """

    residual: FloatArray
    by_cell: FloatArray
    along: FloatArray
    common: FloatArray
    size: FloatArray

    @classmethod
    def of(cls, now: State, measured: _Measured) -> Self:
        rows = measured.rows
        size, values = now.voltages[rows], measured.values[rows]
        factor = float(values @ size) / float(size @ size)
        channels = channel_errors(now)[rows]
        noise = np.diag((measured.deviation[rows] / factor) ** 2)
        return cls(
            residual=values / factor - size,
            by_cell=(now.jacobian * now.conductivity)[rows],
            along=_DIRECTED * anisotropy_slopes(now)[rows],
            common=channels @ channels.T + np.outer(size, size) + noise,
            size=size,
        )

    def covariance(self, error: float) -> FloatArray:
        """(n, n) V² where rows are off by ``error``, in parts of them."""
        return np.asarray(self.common + np.diag((error * self.size) ** 2))

    def log_evidence(self, seen: FloatArray, error: float) -> float:
        """Of the residual where what is ``seen`` (n, k) V of a field and the channels are random."""
        own = np.hstack([seen, self.along])
        try:
            factor, _ = cho_factor(self.covariance(error) + own @ own.T, lower=True)
        except LinAlgError:
            return -math.inf
        spread = cho_solve((factor, True), self.residual)
        return float(-self.residual @ spread / 2 - np.log(np.diag(factor)).sum())


def fitted_sheet(state: State, reference: FloatArray, deviation: FloatArray | float) -> State:
    """The sheet that explains a ``reference`` (n_meas,) V of this standard deviation, V, best.

    ``state`` itself where nothing speaks against it. Rows that are not finite, or broken, do not
    count, and a factor that all voltages have in common means nothing.
    """
    measured = _Measured.of(state, reference, deviation)
    if len(measured.rows) < len(reference) / 2:
        return state
    field, error = _likeliest(state, _Linear.of(state, measured))
    return _fitted(state, measured, field, error)


def _likeliest(state: State, linear: _Linear) -> tuple[FloatArray, float]:
    """(n_cells, k) modes of the likeliest random field, none of an even sheet; and how far rows
    are off."""
    mesh = state.model.mesh
    breadth = math.sqrt(float(mesh.volumes.sum()))
    none = np.zeros((len(mesh.cells), 0))
    fields = [none, *(field_modes(mesh, part * breadth) for part in _LENGTHS)]
    best = (-math.inf, none, 0.0)
    for modes in fields:
        seen = linear.by_cell @ modes
        for uneven, error in product(_UNEVEN[1:] if modes.shape[1] else (0.0,), _ERRORS):
            reach()
            log_evidence = linear.log_evidence(uneven * seen, error)
            if log_evidence > best[0]:
                best = log_evidence, uneven * modes, error
    return best[1], best[2]


def _fitted(state: State, measured: _Measured, field: FloatArray, error: float) -> State:
    """The most likely sheet where ``field`` (n_cells, k) is random: Gauss–Newton."""
    found, now = np.zeros(field.shape[1] + 2), state
    for _ in range(_STEPS):
        linear = _Linear.of(now, measured)
        columns = np.hstack([linear.by_cell @ field, linear.along])
        solved = cho_solve(cho_factor(linear.covariance(error)), columns)
        normal = columns.T @ solved + np.eye(len(found))
        found = np.linalg.solve(normal, solved.T @ (linear.residual + columns @ found))
        now = _sheet(state, field @ found[:-2], _DIRECTED * found[-2:])
    even = not field.shape[1] and math.hypot(*(_DIRECTED * found[-2:])) < _LEAST
    return state if even else now


def _sheet(state: State, uneven: FloatArray, anisotropy: FloatArray) -> State:
    """The sheet with that change (n_cells,) of log σ and that anisotropy."""
    model = state.model
    mesh = directed(model.mesh, anisotropy)
    own = ForwardModel(mesh, model.pattern, model.contact_impedance, model.current)
    return own.at(state.conductivity * np.exp(uneven))
