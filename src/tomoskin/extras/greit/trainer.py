"""GREIT: an operator trained to show small targets as discs (Adler et al. 2009).

For cell i it minimises over its row r_i

    Σ_k (r_i · y_k − x_ik)² + μ r_i Σ r_iᵀ

for training targets k with voltages y_k and desired values x_ik, and noise of covariance Σ. All
rows share one matrix A = Y Yᵀ + μΣ: the operator is X Yᵀ A⁻¹.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import ArrayLike
from scipy.linalg import cho_factor, cho_solve
from scipy.optimize import brentq
from scipy.sparse import csr_array

from tomoskin.core import FloatArray, ModelError, check_positive, refuse_first
from tomoskin.extras.greit.merit import Balls, Targets, centre_of
from tomoskin.imaging import Operator, deviations, noise_figure
from tomoskin.model.forward import ForwardModel
from tomoskin.model.mesh import Mesh

_WEIGHTS = (-10.0, 6.0)
"""Decades in which the weight of the noise is looked for; 0 is as strong as the signal."""

DESIRED_RADIUS = 0.15
"""Radius of the disc that a target is to be shown as, as a part of the sheet's largest extent.

It was chosen on targets along a radius of discs with 8 and 16 electrodes."""


def desired_images(mesh: Mesh, positions: FloatArray, radius: float = DESIRED_RADIUS) -> csr_array:
    """(n_cells, n) images of unit targets at ``positions`` (n, d), per S·m².

    A flat disc around the target (in a volume, a ball), which holds its change of conductivity,
    spread evenly; what of the disc lies beyond the rim is held by the rest. Its ``radius`` is a
    part of the mesh's largest extent. Raises ModelError where the mesh is too coarse for it.
    """
    extent = float(np.ptp(mesh.points, axis=0).max())
    each = list(Balls(mesh).each(positions, radius * extent))
    cells = np.concatenate([cells for cells, _ in each])
    columns = np.repeat(np.arange(len(each)), [len(cells) for cells, _ in each])
    shares = np.concatenate([share for _, share in each])
    disc = csr_array((shares, (cells, columns)), shape=(len(mesh.cells), len(positions)))
    size = mesh.volumes @ disc
    if not (size > 0).all():
        raise ModelError(
            "the desired disc is smaller than the mesh can show", hint="refine the mesh"
        )
    return csr_array(disc.multiply(1.0 / size[None, :]))


@dataclass(frozen=True, eq=False)
class Trainer:
    """What is the same for every weight of the noise.

    ``data`` (n_meas, n) are, in units of the ``noise`` (n_meas,), of mean power 1; ``desired`` are
    the images (n_cells, n), ``middle`` (n_meas,) the data of the target nearest to the centre.
    """

    mesh: Mesh
    data: FloatArray
    noise: FloatArray
    desired: csr_array
    middle: FloatArray

    @classmethod
    def of(
        cls, mesh: Mesh, training: Targets, noise: ArrayLike, radius: float = DESIRED_RADIUS
    ) -> Self:
        """Set up for targets, noise, one deviation or (n_meas,), and the ``radius`` that targets
        are to be shown with. Raises ModelError."""
        data = (training.dv / training.amount[:, None]).T
        sd = deviations(noise, len(data), ModelError)
        refuse_first(~(sd > 0), sd, "noise above 0", "row", ModelError)
        scaled = sd * np.sqrt(((data / sd[:, None]) ** 2).sum() / len(sd))
        centre = int(np.linalg.norm(training.places - centre_of(mesh), axis=1).argmin())
        desired = desired_images(mesh, training.places, radius)
        return cls(mesh, data, scaled, desired, data[:, centre])

    def matrix(self, weight: float) -> tuple[FloatArray, FloatArray]:
        """Operator (n_cells, n_meas) and precision (n_meas, n_meas) at that weight."""
        system = self.data @ self.data.T
        system[np.diag_indices_from(system)] += weight * self.noise**2
        factor = cho_factor(system, lower=True)
        lifted = cho_solve(factor, self.data).T
        return self.desired @ lifted, cho_solve(factor, np.eye(len(system)))

    def weight_for(self, figure: float) -> float:
        """The weight whose operator has that noise figure."""
        check_positive(figure, "a noise figure")

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


TARGET_RADIUS = 0.025
"""Of a training target, as a part of the sheet's largest extent."""


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
    noise
        Standard deviation of the difference data, one number or (n_meas,): only its spread
        over the rows counts.
    noise_figure
        Chooses the weight of the noise; see :func:`tomoskin.imaging.noise_figure`, with the
        training target nearest to the centre.
    count
        Number of training targets, evenly spread over the sheet.

    Attributes
    ----------
    noise_figure
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
        noise: ArrayLike = 1.0,
        noise_figure: float = 1.0,
        count: int = 500,
    ) -> None:
        simulator = model if simulated_on is None else simulated_on
        if simulator.pattern.identity != model.pattern.identity:
            raise ModelError("expected training targets of the same pattern, got another one")
        self.noise_figure = noise_figure
        self.training = Targets.simulate(
            simulator,
            spread_over(simulator.mesh, count),
            radius=_target_radius(simulator.mesh),
            conductivity=conductivity,
            difference=difference,
        )
        trainer = Trainer.of(model.mesh, self.training, noise)
        self.noise_weight = trainer.weight_for(noise_figure)
        matrix, precision = trainer.matrix(self.noise_weight)
        super().__init__(
            model,
            matrix,
            precision=precision,
            reference=model.at(conductivity).voltages,
            difference=difference,
        )

    def weighed(self, noise: ArrayLike, weight: float, radius: float = DESIRED_RADIUS) -> Operator:
        """The operator trained on the same targets for another noise and its weight μ, to show
        them with that ``radius``."""
        trainer = Trainer.of(self.model.mesh, self.training, noise, radius)
        return self.remade(*trainer.matrix(weight))


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
