"""Linear difference imaging with a sharp prior: total variation or L1."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike

from tomoskin.core import FloatArray, Image, ModelError
from tomoskin.imaging.iterative.absolute import STEPS, TOLERANCE, Sharp
from tomoskin.imaging.iterative.newton import Descent, Goal, descend
from tomoskin.imaging.iterative.observation import Observation, Whitened
from tomoskin.model.forward import ForwardModel
from tomoskin.model.prior import Diagonal, SharpPrior

_RANGE, _HALVINGS = (1e-1, 1e3), 6
"""Of alphas, and how often their range is halved: to 15 %."""


@dataclass(frozen=True, eq=False)
class SharpImage:
    """An image, the alpha of it, and how it was found, as of :class:`Absolute`."""

    image: Image
    alpha: float
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
        Hyper-parameter; it enters squared. Without it each image has the largest at which it
        explains its data to their noise (discrepancy principle, Morozov 1966): then the noise has
        to hold what the model gets wrong, too. It is searched from 0.1 to 1000.
    conductivity
        Where to linearise: (n_cells,) or one number, S or S/m.

    Raises
    ------
    ModelError
        For an alpha that is not above 0, or a conductivity that is not real.
    """

    def __init__(
        self,
        model: ForwardModel,
        prior: SharpPrior,
        *,
        alpha: float | None = None,
        conductivity: ArrayLike = 1.0,
    ) -> None:
        if alpha is not None and not (np.isfinite(alpha) and alpha > 0):
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
        if self.alpha is not None:
            return self._image(data, self.alpha)
        low, high = _RANGE
        found = self._image(data, low)
        for _ in range(_HALVINGS):
            alpha = float(np.sqrt(low * high))
            tried = self._image(data, alpha)
            if tried.descent.steps[-1].misfit <= len(data.target):
                low, found = alpha, tried
            else:
                high = alpha
        return found

    def _image(self, data: Whitened, alpha: float) -> SharpImage:
        jacobian = data.rows @ self.jacobian
        mesh = self.model.mesh
        cost = Sharp(self.prior, mesh, alpha**2, Diagonal(np.empty(0)))
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
        return SharpImage(image, alpha, descent)


@dataclass(frozen=True, eq=False)
class _Prediction:
    """What the linear model gives at one image."""

    predicted: FloatArray
    jacobian: FloatArray
