"""Anisotropy of a sheet: its conductivity differs by direction.

Knits are so, and any sheet that is wrapped round something: its layer is strained one way.
With one tensor exp(D) all over, D symmetric and without a trace, its voltages are those of the
same sheet with the metric exp(−D) instead of none, up to a factor.
"""

from __future__ import annotations

import numpy as np

from tomoskin.core import FloatArray
from tomoskin.model.forward import State
from tomoskin.model.mesh import Mesh


def anisotropy_slopes(state: State) -> FloatArray:
    """(n_meas, 2) V: derivatives of the voltages by xx and xy of D, −∫ ∇u · σD ∇w."""
    x, y = state.gradient[:, 0], state.gradient[:, 1]
    flow_x, flow_y = x * state.conductivity, y * state.conductivity
    along, across = flow_x @ x.T - flow_y @ y.T, flow_x @ y.T + flow_y @ x.T
    return -np.column_stack([state.model.voltages(part) for part in (along, across)])


def directed(mesh: Mesh, anisotropy: FloatArray) -> Mesh:
    """The mesh whose metric is exp(−D) in the frame of its own; D by ``anisotropy`` (xx, xy)."""
    size = float(np.hypot(*anisotropy))
    part = np.sinh(size) / size if size else 1.0
    within = np.cosh(size) * np.eye(2) - part * _traceless(anisotropy)
    if mesh.metric is None:
        return mesh.with_metric(np.tile(within, (len(mesh.cells), 1, 1)))
    frame = np.linalg.cholesky(mesh.metric)
    return mesh.with_metric(frame @ within @ frame.transpose(0, 2, 1))


def _traceless(anisotropy: FloatArray) -> FloatArray:
    xx, xy = anisotropy
    return np.array([[xx, xy], [xy, -xx]])
