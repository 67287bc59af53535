"""What a trained operator aims at, and the least squares that train it, for any weight of noise.

For cell i it minimises over its row r_i

    Σ_k w_ik (r_i · y_k − x_ik)² + μ r_i Σ r_iᵀ

for training targets k with voltages y_k, desired values x_ik and weights w_ik, and noise of
covariance Σ. Beyond the disc and its edge the weight is the same for all; so all rows share one
matrix A = w Y Yᵀ + μΣ, and each differs from it by the few targets near its cell (Woodbury):

    r_i = c_iᵀ (I + Y_SᵀA⁻¹Y_S D_i)⁻¹ Y_SᵀA⁻¹,   c_ik = w_ik x_ik,   D_i = diag(w_ik − w).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.linalg import cho_factor, cho_solve
from scipy.optimize import brentq
from scipy.sparse import csr_array

from tomoskin.core import FloatArray, IntArray, ModelError
from tomoskin.imaging.linear.operator import Operator
from tomoskin.imaging.trained.merit import noise_figure
from tomoskin.imaging.trained.targets import Balls, Targets, centre_of
from tomoskin.model.forward import ForwardModel
from tomoskin.model.mesh import Mesh

_WEIGHTS = (-10.0, 6.0)
"""Decades in which the weight of the noise is looked for; 0 is as strong as the signal."""

_BATCH = 256


@dataclass(frozen=True, slots=True)
class Desired:
    """A flat disc around the target, then an edge of free form, then nothing.

    The disc holds the target's change of conductivity, spread evenly: what of it lies beyond
    the rim is held by the rest. In a volume it is a ball. The defaults were chosen on targets
    along a radius of discs with 8 and 16 electrodes; an edge or unequal weights sharpen or calm
    the image at the price of its amplitude.

    Attributes
    ----------
    radius
        Of the disc, as a part of the sheet's largest extent.
    edge
        Width of the ring around it whose cells do not matter, likewise.
    inside, outside
        Weight of an error within the disc and beyond the ring (Adler et al. 2009, section 3.2).
    """

    radius: float = 0.15
    edge: float = 0.0
    inside: float = 1.0
    outside: float = 1.0

    def __post_init__(self) -> None:
        """Raise ModelError for a size or weight that is impossible."""
        for name, low in (("radius", True), ("edge", False), ("inside", True), ("outside", True)):
            value = getattr(self, name)
            if not (np.isfinite(value) and (value > 0 if low else value >= 0)):
                bound = "above 0" if low else "of 0 or more"
                raise ModelError(f"expected {name} {bound}, got {value}", where="desired response")

    def on(self, mesh: Mesh, positions: FloatArray) -> tuple[csr_array, csr_array]:
        """Weights and weighted images for unit targets at ``positions`` (n, d).

        Returns
        -------
        Both (n_cells, n) and sparse: the weight of each cell less that outside, and weight
        times desired value, per S·m².
        """
        extent = float(np.ptp(mesh.points, axis=0).max())
        balls = Balls(mesh)
        disc = _shares(balls, positions, self.radius * extent)
        ring = _shares(balls, positions, (self.radius + self.edge) * extent)
        size = mesh.volumes @ disc
        if not (size > 0).all():
            raise ModelError(
                "the desired disc is smaller than the mesh can show",
                hint="widen its radius, or refine the mesh",
            )
        scaled = disc.multiply(1.0 / size[None, :])
        return csr_array(self.inside * disc - self.outside * ring), csr_array(self.inside * scaled)


def _shares(balls: Balls, positions: FloatArray, radius: float) -> csr_array:
    cells, shares, columns = [], [], []
    for number, (cell, share) in enumerate(balls.each(positions, radius)):
        cells.append(cell)
        shares.append(share)
        columns.append(np.full(len(cell), number))
    where = (np.concatenate(cells), np.concatenate(columns))
    shape = (len(balls.mesh.cells), len(positions))
    return csr_array((np.concatenate(shares), where), shape=shape)


@dataclass(frozen=True, eq=False)
class Trainer:
    """What is the same for every weight of the noise.

    ``data`` (n_meas, n) and ``noise`` (n_meas,) are scaled to equal mean power. ``near``
    (n_cells, s) holds the targets whose disc or edge reach a cell, filled up with any others
    whose ``extra`` (w_ik − w) and ``goal`` (w_ik x_ik), both (n_cells, s), are zero.
    """

    mesh: Mesh
    data: FloatArray
    noise: FloatArray
    outside: float
    near: IntArray
    extra: FloatArray
    goal: FloatArray
    middle: FloatArray

    @classmethod
    def of(cls, mesh: Mesh, training: Targets, desired: Desired, noise: ArrayLike) -> Trainer:
        """Set up for targets and noise, one deviation or (n_meas,). Raises ModelError."""
        data = (training.dv / training.amount[:, None]).T
        sd = np.asarray(noise, dtype=np.float64)
        if sd.shape not in ((), (len(data),)):
            raise ModelError(f"expected noise of shape ({len(data)},), got {sd.shape}")
        sd = np.broadcast_to(sd, (len(data),))
        if not (np.isfinite(sd).all() and (sd > 0).all()):
            raise ModelError(f"expected finite noise above 0, got {sd.min():g} to {sd.max():g}")
        scaled = sd * np.sqrt((data**2).sum() / (sd**2).sum())
        extra, goal = desired.on(mesh, training.places)
        near = _near(extra, goal)
        centre = int(np.linalg.norm(training.places - centre_of(mesh), axis=1).argmin())
        return cls(
            mesh,
            data,
            scaled,
            desired.outside,
            near,
            np.take_along_axis(extra.toarray(), near, axis=1),
            np.take_along_axis(goal.toarray(), near, axis=1),
            data[:, centre],
        )

    def matrix(self, weight: float) -> tuple[FloatArray, FloatArray]:
        """Operator (n_cells, n_meas) and precision (n_meas, n_meas) at that weight."""
        system = self.outside * self.data @ self.data.T
        system[np.diag_indices_from(system)] += weight * self.noise**2
        factor = cho_factor(system, lower=True)
        lifted = cho_solve(factor, self.data).T
        between = lifted @ self.data
        shares = np.concatenate(
            [self._shares(between, slice(i, i + _BATCH)) for i in range(0, len(self.near), _BATCH)]
        )
        rows = np.repeat(np.arange(len(self.near)), self.near.shape[1])
        where = (rows, self.near.ravel())
        table = csr_array((shares.ravel(), where), shape=(len(self.near), len(lifted)))
        return table @ lifted, cho_solve(factor, np.eye(len(system)))

    def _shares(self, between: FloatArray, cells: slice) -> NDArray[Any]:
        """(b, s): (I + D M)⁻¹ c for each cell of the batch."""
        near, extra = self.near[cells], self.extra[cells]
        if not extra.any():
            return self.goal[cells]
        system = extra[:, :, None] * between[near[:, :, None], near[:, None, :]]
        diagonal = np.arange(near.shape[1])
        system[:, diagonal, diagonal] += 1.0
        return np.asarray(np.linalg.solve(system, self.goal[cells][:, :, None])[:, :, 0])

    def weight_for(self, figure: float) -> float:
        """The weight whose operator has that noise figure."""
        if not (np.isfinite(figure) and figure > 0):
            raise ModelError(f"expected a noise figure above 0, got {figure}")

        def excess(decade: float) -> float:
            matrix, _ = self.matrix(10.0**decade)
            reached = noise_figure(matrix, self.mesh.volumes, self.middle, self.noise)
            return float(np.log(reached / figure))

        low, high = (excess(decade) for decade in _WEIGHTS)
        if low * high > 0:
            span = sorted(figure * np.exp((low, high)))
            raise ModelError(
                f"expected a noise figure from {span[0]:.2g} to {span[1]:.2g}, got {figure:g}"
            )
        return float(10.0 ** float(brentq(excess, *_WEIGHTS, xtol=3e-3)))


def _near(extra: csr_array, goal: csr_array) -> IntArray:
    """(n_cells, s) targets that reach each cell first, then others to fill the row."""
    reach = (abs(extra) + abs(goal)).toarray() > 0
    most = max(int(reach.sum(axis=1).max()), 1)
    return np.asarray(np.argsort(~reach, axis=1, kind="stable")[:, :most])


TARGET_RADIUS = 0.025
"""Of a training target, as a part of the sheet's largest extent."""


@dataclass(frozen=True, eq=False)
class TrainingSettings:
    """What an operator is trained for.

    Attributes
    ----------
    desired
        The response that is aimed at; without it, the default one.
    noise
        Standard deviation of the difference data, one number or (n_meas,): only its spread
        over the rows counts.
    noise_figure
        Chooses the weight of the noise; see :func:`tomoskin.imaging.noise_figure`, with the
        training target nearest to the centre.
    count
        Number of training targets, evenly spread over the sheet.
    """

    desired: Desired | None = None
    noise: ArrayLike = 1.0
    noise_figure: float = 1.0
    count: int = 500


class Greit(Operator):
    """Trained operator for a sheet of any shape, or a volume.

    Parameters
    ----------
    model
        Its mesh is the image's.
    simulated_on
        Model that simulates the training targets, by the exact local update; with the same
        pattern, and best on a finer mesh. Without it, ``model``.
    conductivity
        Of the untouched sheet, one number, S or S/m.
    difference
        "plain" or "normalised".
    settings
        Fields of :class:`TrainingSettings`: ``desired``, ``noise``, ``noise_figure``, ``count``.

    Attributes
    ----------
    desired, noise_figure
        As given.
    noise_weight
        μ that has this noise figure, where signal and noise are of equal power at 1.
    training
        The targets.

    Notes
    -----
    ``without`` fills excluded rows as training targets and noise lead one to expect them; the
    operator is not trained again.

    Raises
    ------
    ModelError
        When the patterns differ, fewer than 10 targets are asked for, a setting is impossible,
        or no weight has that noise figure.
    """

    def __init__(
        self,
        model: ForwardModel,
        *,
        simulated_on: ForwardModel | None = None,
        conductivity: float = 1.0,
        difference: str = "plain",
        **settings: Any,
    ) -> None:
        training = TrainingSettings(**settings)
        simulator = model if simulated_on is None else simulated_on
        if simulator.pattern.identity != model.pattern.identity:
            raise ModelError("expected training targets of the same pattern, got another one")
        self.desired, self.noise_figure = training.desired or Desired(), training.noise_figure
        self.training = Targets.simulate(
            simulator,
            spread_over(simulator.mesh, training.count),
            radius=_target_radius(simulator.mesh),
            conductivity=conductivity,
            difference=difference,
        )
        trainer = Trainer.of(model.mesh, self.training, self.desired, training.noise)
        self.noise_weight = trainer.weight_for(self.noise_figure)
        matrix, precision = trainer.matrix(self.noise_weight)
        super().__init__(
            model,
            matrix,
            precision=precision,
            reference=model.at(conductivity).voltages,
            difference=difference,
        )


def _target_radius(mesh: Mesh) -> float:
    """Small, but not so small that it falls between the points that sample a cell."""
    cell = float(mesh.volumes.max()) ** (1.0 / mesh.dimension)
    return float(max(TARGET_RADIUS * np.ptp(mesh.points, axis=0).max(), cell))


def spread_over(mesh: Mesh, count: int) -> FloatArray:
    """(count, d) m: centroids of cells, each as far as possible from those before it.

    Raises ModelError for fewer than 10, or more than there are cells.
    """
    if not 10 <= count <= len(mesh.cells):
        raise ModelError(f"expected 10 to {len(mesh.cells)} training targets, got {count}")
    centroids = mesh.centroids
    chosen = [int(np.linalg.norm(centroids - centre_of(mesh), axis=1).argmin())]
    gap = np.full(len(centroids), np.inf)
    for _ in range(count - 1):
        gap = np.minimum(gap, np.linalg.norm(centroids - centroids[chosen[-1]], axis=1))
        chosen.append(int(gap.argmax()))
    return np.asarray(centroids[chosen])
