"""The model and its operator: one mesh, the same work by tomoskin, plain scipy and pyEIT."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np
import scipy.linalg

from forward_cases import PATTERN, disc, medians
from forward_measure import ALPHA, measure_touch, set_up
from forward_peer import INSTALLED, Peer
from forward_script import Script
from tomoskin.core import FloatArray
from tomoskin.model.forward import ForwardModel
from whole_line import Line

CELLS, SECONDS = 3000, 8.0
WHATS = {
    "forward": "voltages of a new conductivity",
    "jacobian": "Jacobian with its solves",
    "set-up": "mesh to one-step operator (NOSER)",
    "picture": "picture of a frame's voltages",
}


def forward_lines() -> Iterator[Line]:
    """Every call of the three by turns."""
    case = disc("3k", CELLS)
    model = ForwardModel(case.mesh, PATTERN, case.contact_impedance)
    sigma = 1.0 + 0.1 * np.random.default_rng(1).random(len(case.mesh.cells))
    script = Script(case.mesh, PATTERN, case.contact_impedance)
    operator, plain = set_up(case), _plain_operator(script, sigma)
    change = 1e-3 * model.solve(sigma).voltages
    calls: dict[str, Callable[[], object]] = {
        "forward": lambda: model.solve(sigma),
        "scipy forward": lambda: script.voltages(sigma),
        "jacobian": lambda: model.jacobian(sigma),
        "scipy jacobian": lambda: script.jacobian(sigma),
        "set-up": lambda: set_up(case),
        "scipy set-up": lambda: _plain_operator(script, sigma),
        "picture": lambda: operator(change),
        "scipy picture": lambda: plain @ change,
    }
    if INSTALLED:
        calls |= _peer_calls(Peer(case.mesh, PATTERN), sigma, change)
    times = medians(calls, SECONDS)
    for name, what in WHATS.items():
        scipy_ms, peer_ms = (_ms(times.get(f"{who} {name}")) for who in ("scipy", "peer"))
        yield Line(what, "ms", _ms(times[name]), scipy=scipy_ms, peer=peer_ms)
    touch = measure_touch(case).times
    yield Line(
        "voltages of a touch of 150 cells (local update)",
        "ms",
        _ms(touch["update"]),
        "≤ 0.5",
        scipy=_ms(touch["script forward"]),
        peer=_ms(times.get("peer forward")),
    )


def _ms(seconds: float | None) -> float | None:
    return None if seconds is None else 1e3 * seconds


def _plain_operator(script: Script, sigma: FloatArray) -> FloatArray:
    """(n_cells, n_meas), as it stands in textbooks: one unknown for each cell."""
    jacobian = script.jacobian(sigma)
    normal = jacobian.T @ jacobian
    normal[np.diag_indices_from(normal)] += ALPHA**2 * np.sqrt(normal.diagonal())
    found: FloatArray = scipy.linalg.solve(normal, jacobian.T, assume_a="pos")
    return found


def _peer_calls(
    peer: Peer, sigma: FloatArray, change: FloatArray
) -> dict[str, Callable[[], object]]:
    peer.prepare()
    operator = peer.set_up(ALPHA)
    return {
        "peer forward": lambda: peer.forward(sigma),
        "peer jacobian": lambda: peer.jacobian(sigma),
        "peer set-up": lambda: peer.set_up(ALPHA),
        "peer picture": lambda: -np.dot(operator, change),
    }
