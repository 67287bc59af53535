"""What electrodes and channels do to a reference: contacts, gains and offsets of their own."""

from __future__ import annotations

import numpy as np

from tomoskin.core import FloatArray
from tomoskin.model.forward import State

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
