"""What a reference is explained with: an anisotropy, contacts and channels, and a random field.

Knits conduct otherwise along than across, and so does any sheet that is wrapped round something:
its layer is strained one way. With one tensor exp(D) all over, D symmetric and without a trace, its
voltages are those of the same sheet with the metric exp(−D) instead of none, up to a factor.
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
    xx, xy = anisotropy
    within = np.cosh(size) * np.eye(2) - part * np.array([[xx, xy], [xy, -xx]])
    if mesh.metric is None:
        return mesh.with_metric(np.tile(within, (len(mesh.cells), 1, 1)))
    frame = np.linalg.cholesky(mesh.metric)
    return mesh.with_metric(frame @ within @ frame.transpose(0, 2, 1))


_CONTACT = 0.3
"""Standard deviation of the logarithm of each contact impedance."""

_GAIN, _OFFSET = 0.003, 1e-4
"""Standard deviations of a channel's gain, in parts of it, and of its offset, V."""


def channel_errors(state: State) -> FloatArray:
    """(n_meas, 3 · n_electrodes) V: what one standard deviation of each does to the rows."""
    model, pattern = state.model, state.model.pattern
    contacts = _CONTACT * state.contact_jacobian * model.contact_impedance
    potentials = _potentials(state)
    rows, electrodes = np.arange(pattern.n_meas)[:, None], pattern.measure
    signs = np.array([1.0, -1.0])
    gains, offsets = np.zeros_like(contacts), np.zeros_like(contacts)
    np.add.at(gains, (rows, electrodes), signs * potentials[rows, electrodes])
    np.add.at(offsets, (rows, electrodes), signs)
    return np.hstack([contacts, _GAIN * gains, _OFFSET * offsets])


def _potentials(state: State) -> FloatArray:
    """(n_meas, n_electrodes) V against the sink of each row's drive."""
    model, pattern = state.model, state.model.pattern
    source, sink = pattern.drives.T
    seen = (state.transfer_resistance[:, source] - state.transfer_resistance[:, sink]).T
    seen = seen - seen[np.arange(len(sink)), sink][:, None]
    volts = np.broadcast_to(model.current, len(sink))[:, None] * seen
    return np.asarray(volts[pattern.drive_index])


_NODES = 260
"""Cells that carry a field; the others follow from them (Nyström's method)."""

_MODES = 60


def field_modes(mesh: Mesh, length: float) -> FloatArray:
    """(n_cells, k): modes of a field of unit variance, each as long as its standard deviation.

    Its correlation is exp(−d²/2 ``length``²), length in m, in the sheet's flat coordinates
    (Rasmussen & Williams 2006, equations 4.9 and 8.1).
    """
    points = mesh.centroids
    nodes = points[:: max(1, len(points) // _NODES)]
    size, vector = np.linalg.eigh(_correlation(nodes, nodes, length))
    kept = np.flatnonzero(size > 1e-6 * size[-1])[-_MODES:]
    return np.asarray(_correlation(points, nodes, length) @ (vector[:, kept] / np.sqrt(size[kept])))


def _correlation(one: FloatArray, other: FloatArray, length: float) -> FloatArray:
    square = ((one[:, None] - other) ** 2).sum(axis=2)
    return np.asarray(np.exp(-square / (2 * length**2)))
