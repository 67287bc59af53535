"""Linear difference imaging with a sharp prior: total variation or L1."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike

from tomoskin.core import FloatArray, Image, ModelError
from tomoskin.imaging.iterative.absolute import STEPS, TOLERANCE, Sharp
from tomoskin.imaging.iterative.newton import Descent, Goal, descend
from tomoskin.imaging.iterative.observation import Observation
from tomoskin.model.forward import ForwardModel
from tomoskin.model.prior import Diagonal, SharpPrior


@dataclass(frozen=True, eq=False)
class SharpImage:
    """An image, and how it was found, as of :class:`Absolute`."""

    image: Image
    descent: Descent = field(repr=False)

    def __str__(self) -> str:
        """The iterations, and why they ended."""
        return str(self.descent)


class SharpDifference:
    """Minimises ‖(dv − J x)/noise‖² + α²·cost(x/σ₀) over changes x of the conductivity.

    Linear as :class:`OneStep`, yet with no matrix made once: the cost keeps edges, and each image
    takes some iterations.

    Parameters
    ----------
    model
        The forward model to linearise.
    prior
        A :class:`TotalVariation` or :class:`Sparse` of the relative change.
    alpha
        Hyper-parameter; it enters squared.
    conductivity
        Where to linearise: (n_cells,) or one number, S or S/m.

    Raises
    ------
    ModelError
        For alpha ≤ 0 or a conductivity that is not real.
    """

    def __init__(
        self,
        model: ForwardModel,
        prior: SharpPrior,
        *,
        alpha: float,
        conductivity: ArrayLike = 1.0,
    ) -> None:
        if not (np.isfinite(alpha) and alpha > 0):
            raise ModelError(f"expected alpha above 0, got {alpha}")
        state = model.at(conductivity)
        if state.conductivity.ndim > 1 or np.iscomplexobj(state.conductivity):
            raise ModelError(
                "expected one real conductivity per cell, got tensors or complex values"
            )
        self.model = model
        self.prior = prior
        self.alpha = alpha
        self.conductivity = state.conductivity
        self.jacobian = state.jacobian * state.conductivity

    def __call__(self, observation: Observation) -> SharpImage:
        """Image of difference data. Raises DataError when they are not of this pattern."""
        data = observation.whitened(self.model.pattern.n_meas)
        jacobian = data.rows @ self.jacobian
        mesh = self.model.mesh
        cost = Sharp(self.prior, mesh, self.alpha**2, Diagonal(np.empty(0)))
        descent = descend(
            Goal(
                lambda x: _Prediction(jacobian @ x, jacobian),
                data.target,
                cost.penalty,
                cost.energy,
            ),
            Descent.begin(len(mesh.cells)),
            most=STEPS,
            tolerance=TOLERANCE,
        )
        unit = "S" if mesh.dimension == 2 else "S/m"
        image = Image(descent.unknowns * self.conductivity, unit, mesh.identity)
        return SharpImage(image, descent)


@dataclass(frozen=True, eq=False)
class _Prediction:
    """What the linear model gives at one image."""

    predicted: FloatArray
    jacobian: FloatArray
