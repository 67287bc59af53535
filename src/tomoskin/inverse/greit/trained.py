"""GREIT: an operator trained to show small targets as a stated response (Adler et al. 2009)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from tomoskin.core import FloatArray, ModelError
from tomoskin.forward import ForwardModel
from tomoskin.inverse.greit.targets import Targets, centre_of
from tomoskin.inverse.greit.trainer import Desired, Trainer
from tomoskin.inverse.linear.operator import Operator
from tomoskin.mesh import Mesh

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
        Chooses the weight of the noise; see :func:`tomoskin.inverse.noise_figure`, with the
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
