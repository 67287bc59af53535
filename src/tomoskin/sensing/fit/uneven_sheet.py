"""A sheet as its reference tells of it: uneven, and conducting otherwise along than across.

Knits conduct otherwise along than across, and so does any sheet that is wrapped round something:
its layer is strained one way. With one tensor exp(D) all over, D symmetric and without a trace, its
voltages are those of the same sheet with the metric exp(−D) instead of none, up to a factor.

The logarithm of the conductivity is a Gaussian random field. How uneven it is, over which lengths,
and how well rows follow the model is what makes the reference likeliest (evidence: MacKay 2003,
chapter 28); the field itself is the most likely one then. Both are found anew about the last sheet
(Gauss–Newton).
"""

from __future__ import annotations

import math
from collections.abc import Generator, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Self

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import LinAlgError, cho_factor, cho_solve, cholesky, solve_triangular

from tomoskin.core import FloatArray, reach
from tomoskin.model.forward import ForwardModel, State
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


_UNEVEN = (0.01, 0.03, 0.06, 0.12, 0.24)
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

_STEPS = 4

_MOST_UNEVEN, _MOST_DIRECTED = 3.0, 1.0
"""Sizes of log σ over a sheet and of an anisotropy that no sheet has: twelve and five times what is
expected at the most."""


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
    def about(
        cls, now: State, values: FloatArray, deviation: FloatArray, rows: NDArray[np.intp]
    ) -> Generator[None, None, Self]:
        """About a sheet, a piece between two yields."""
        size = now.voltages[rows]
        factor = float(values @ size) / float(size @ size)
        yield
        by_cell = (now.jacobian * now.conductivity)[rows]
        yield
        channels = channel_errors(now)[rows]
        yield
        noise = np.diag((deviation / factor) ** 2)
        return cls(
            residual=values / factor - size,
            by_cell=by_cell,
            along=_DIRECTED * anisotropy_slopes(now)[rows],
            common=channels @ channels.T + np.outer(size, size) + noise,
            size=size,
        )

    def covariance(self, error: float) -> FloatArray:
        """(n, n) V² where rows are off by ``error``, in parts of them."""
        return np.asarray(self.common + np.diag((error * self.size) ** 2))

    def explained(
        self, data: FloatArray, field: FloatArray, error: float
    ) -> Generator[None, None, tuple[FloatArray, FloatArray]]:
        """(n_cells,) change of log σ and (2,) anisotropy, in deviations, that explain ``data`` (n,)
        V best where ``field`` (n_cells, k) is random; a piece between two yields."""
        yield
        columns = np.hstack([self.by_cell @ field, self.along])
        yield
        solved = cho_solve(cho_factor(self.covariance(error)), columns)
        normal = columns.T @ solved + np.eye(columns.shape[1])
        amplitudes = np.asarray(np.linalg.solve(normal, solved.T @ data), np.float64)
        return np.asarray(field @ amplitudes[:-2]), amplitudes[-2:]

    def whitened(self, columns: FloatArray, error: float) -> tuple[FloatArray, float]:
        """``columns`` (n, k) V where channels, an anisotropy and an ``error`` of rows are noise of
        variance one; and half the logarithm of that noise's determinant.

        Raises
        ------
        LinAlgError
            When a row has no noise.
        """
        root = cholesky(self.covariance(error) + self.along @ self.along.T, lower=True)
        white = solve_triangular(root, columns, lower=True, check_finite=False)
        return white, float(np.log(np.diag(root)).sum())


@lru_cache(maxsize=4)
def fields_of(mesh: Mesh) -> list[FloatArray]:
    """(n_cells, k) modes of a field of each length: some ten milliseconds of work for a mesh."""
    breadth = math.sqrt(float(mesh.volumes.sum()))
    return [field_modes(mesh, part * breadth) for part in _LENGTHS]


def fitting_sheet(
    state: State, reference: FloatArray, deviation: FloatArray | float
) -> Generator[None, None, State]:
    """The sheet that explains a ``reference`` (n_meas,) V of this standard deviation, V, best; a
    piece between each two yields.

    ``state`` itself where nothing speaks against it, and where no sheet comes near: the reference
    is another skin's. Rows that are not finite do not count,
    and a factor that all voltages have in common means nothing.
    """
    finite = np.flatnonzero(np.isfinite(reference))
    if len(finite) < len(reference) / 2:
        return state
    mesh = state.model.mesh
    fields = fields_of(mesh)
    values = reference[finite]
    deviation = np.broadcast_to(deviation, reference.shape)[finite]
    uneven, anisotropy, now = np.zeros(len(mesh.cells)), np.zeros(2), state
    for _ in range(_STEPS):
        linear = yield from _Linear.about(now, values, deviation, finite)
        yield
        data = linear.residual + linear.by_cell @ uneven + linear.along @ anisotropy
        likeliest = yield from _likeliest(fields, linear, data)
        if likeliest is None:
            return state
        uneven, anisotropy = yield from linear.explained(data, *likeliest)
        if not _is_sheet(uneven, anisotropy):
            return state
        yield
        now = yield from _sheet(state, uneven, _DIRECTED * anisotropy)
        yield
    even = not uneven.any() and _DIRECTED * math.hypot(*anisotropy) < _LEAST
    return state if even else now


def _is_sheet(uneven: FloatArray, anisotropy: FloatArray) -> bool:
    """Whether a change (n_cells,) of log σ and an anisotropy (2,), in deviations, may be those of a
    sheet; where a reference is another skin's they grow from step to step."""
    size = _DIRECTED * math.hypot(*anisotropy)
    return bool(np.abs(uneven).max(initial=0.0) < _MOST_UNEVEN and size < _MOST_DIRECTED)


def _likeliest(
    fields: Sequence[FloatArray], linear: _Linear, data: FloatArray
) -> Generator[None, None, tuple[FloatArray, float] | None]:
    """(n_cells, k) modes of the random field that makes ``data`` (n,) V likeliest, zero for an even
    sheet; and how far rows are off. None where none has a likelihood that is a number."""
    best: tuple[float, FloatArray, float] | None = None
    seen = []
    for modes in fields:
        yield
        seen.append(linear.by_cell @ modes)
    columns = np.column_stack([*seen, data])
    ends = np.cumsum([modes.shape[1] for modes in fields])
    for error in _ERRORS:
        reach()
        yield
        try:
            white, log_size = linear.whitened(columns, error)
        except LinAlgError:
            continue
        *white_modes, (own,) = (part.T for part in np.split(white, ends, axis=1))
        for modes, rows in zip(fields, white_modes, strict=True):
            square = np.vstack([rows, own]) @ np.vstack([rows, own]).T
            for size in (0.0, *_UNEVEN):
                log_evidence = _log_evidence(square, size) - log_size
                if log_evidence > (-math.inf if best is None else best[0]):
                    best = log_evidence, size * modes, error
    return None if best is None else best[1:]


def _log_evidence(square: FloatArray, size: float) -> float:
    """Of white data, where the modes of a field have random amplitudes of that ``size``.

    ``square`` (k + 1, k + 1): products of what the k modes do to the data, and the data. Of a root
    of these, the modes' diagonal is the determinant's, and what is left of the data the misfit's.
    """
    scale = np.append(np.full(len(square) - 1, size), 1.0)
    noise = np.append(np.ones(len(square) - 1), 0.0)
    try:
        root = np.diag(np.linalg.cholesky(square * scale[:, None] * scale + np.diag(noise)))
    except LinAlgError:
        return -math.inf
    return float(-(root[-1] ** 2) / 2 - np.log(root[:-1]).sum())


def _sheet(
    state: State, uneven: FloatArray, anisotropy: FloatArray
) -> Generator[None, None, State]:
    """The sheet with that change (n_cells,) of log σ and that anisotropy."""
    model = state.model
    mesh = directed(model.mesh, anisotropy)
    yield
    own = ForwardModel(mesh, model.pattern, model.contact_impedance, model.current)
    yield
    return own.at(state.conductivity * np.exp(uneven))
