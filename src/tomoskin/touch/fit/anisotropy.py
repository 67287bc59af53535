"""Anisotropy of a sheet: its conductivity differs by direction, and its reference shows it.

Knits are so, and any sheet that is wrapped round something: its layer is strained one way.
With one tensor exp(D) all over, D symmetric and without a trace, its voltages are those of the
same sheet with the metric exp(−D) instead of none, up to a factor.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from tomoskin.core import FloatArray
from tomoskin.forward import ForwardModel, State
from tomoskin.mesh import Mesh

_LEAST = 0.03
"""Size of D below which a sheet counts as isotropic."""

_BETTER = 0.8
"""The residual of a reference falls to this part of it at least, or D explains nothing."""

_STEPS = 4


def with_anisotropy(state: State, reference: FloatArray) -> State:
    """The sheet with the D with which it explains a ``reference`` (n_meas,) V best.

    ``state`` itself where there is no such D: it is small, or explains nothing.
    """
    total, now = np.zeros(2), state
    first = residual = np.inf
    for step in range(_STEPS):
        change, residual = _explained(now, reference)
        first = residual if step == 0 else first
        total = total + change
        if not _LEAST < np.hypot(*total) < 1.0:
            return state
        now = _with_metric(state, total)
    _, residual = _explained(now, reference)
    return now if residual < _BETTER * first else state


def _explained(state: State, reference: FloatArray) -> tuple[FloatArray, float]:
    """(2,) xx and xy by which D is to change, beside a common factor; and the residual, V, of
    the reference with the factor alone."""
    finite = np.isfinite(reference)
    columns = np.column_stack([state.voltages, *_slopes(state)])[finite]
    data, own = reference[finite], columns[:, 0]
    parts, *_ = np.linalg.lstsq(columns, data, rcond=None)
    alone = data - own * (own @ data) / (own @ own)
    return parts[1:] / parts[0], float(np.linalg.norm(alone))


def _slopes(state: State) -> tuple[FloatArray, FloatArray]:
    """(n_meas,) V twice: derivatives by xx and xy of D, −∫ ∇u · σD ∇w."""
    x, y = state.gradient[:, 0], state.gradient[:, 1]
    flow_x, flow_y = x * state.conductivity, y * state.conductivity
    along, across = flow_x @ x.T - flow_y @ y.T, flow_x @ y.T + flow_y @ x.T
    one, other = (-np.asarray(state.model.voltages(part)) for part in (along, across))
    return one, other


def _with_metric(state: State, anisotropy: FloatArray) -> State:
    model = state.model
    mesh = _directed(model.mesh, anisotropy)
    own = ForwardModel(mesh, model.pattern, model.contact_impedance, model.current)
    return own.at(state.conductivity)


def _directed(mesh: Mesh, anisotropy: FloatArray) -> Mesh:
    """The mesh whose metric is exp(−D) in the frame of its own."""
    size = float(np.hypot(*anisotropy))
    part = (
        np.sinh(size)
        / size
        * np.array([[anisotropy[0], anisotropy[1]], [anisotropy[1], -anisotropy[0]]])
    )
    within = np.cosh(size) * np.eye(2) - part
    if mesh.metric is None:
        return replace(mesh, metric=np.tile(within, (len(mesh.cells), 1, 1)))
    frame = np.linalg.cholesky(mesh.metric)
    return replace(mesh, metric=frame @ within @ frame.transpose(0, 2, 1))
