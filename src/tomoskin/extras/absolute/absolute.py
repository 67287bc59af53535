"""Absolute imaging: the conductivity itself, from one set of voltages, by iteration; and linear
difference imaging with a sharp prior: total variation or L1."""

from __future__ import annotations

from dataclasses import KW_ONLY, dataclass, field
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tomoskin.core import FloatArray, Image, ModelError, check_positive
from tomoskin.extras.absolute.newton import Descent, Goal, descend
from tomoskin.extras.absolute.unknowns import (
    Contacts,
    ImageMap,
    Joint,
    LinearMap,
    ModelPoint,
    Observation,
    Unknowns,
    Whitened,
    others,
)
from tomoskin.model.forward import ForwardModel
from tomoskin.model.mesh import Mesh
from tomoskin.model.prior import Diagonal, Penalty, PriorLike, SharpPrior, penalty_of

STEPS = 20
"""Most iterations."""

REACH = 2.0
"""No logarithm changes by more in one iteration: beyond, the linearised problem is no guide."""

TOLERANCE = 1e-4
"""An iteration that lowers the objective by less than this part of it is the last."""


@dataclass(frozen=True, eq=False)
class Absolute:
    """Conductivity and contacts that explain what was measured, and how they were found.

    Attributes
    ----------
    conductivity
        Per cell, S or S/m.
    background
        S or S/m, what the image differs from.
    contact_impedance
        (n_electrodes,) Ω·m or Ω·m².
    voltages
        (n_meas,) V of the model there.
    n_values
        Different values that were measured: a misfit near it explains them to their noise.
    descent
        The iterations, why they stopped, and whether there was nothing left to gain.
    """

    conductivity: Image
    background: float
    contact_impedance: FloatArray
    voltages: FloatArray
    n_values: int
    descent: Descent = field(repr=False)

    @classmethod
    def of(cls, point: ModelPoint, descent: Descent) -> Absolute:
        """The result of the last iteration."""
        mesh = point.of.model.mesh
        unit = "S" if mesh.dimension == 2 else "S/m"
        return cls(
            conductivity=Image(point.conductivity, unit, mesh.identity),
            background=point.background,
            contact_impedance=point.contact_impedance,
            voltages=point.state.voltages,
            n_values=len(point.of.rows),
            descent=descent,
        )

    @property
    def misfit(self) -> float:
        """Square sum of the residuals, each over its noise."""
        return self.descent.steps[-1].misfit

    def __str__(self) -> str:
        """The iterations, and why they ended."""
        return f"{self.descent}; misfit {self.misfit:.4g} of {self.n_values} values"


@dataclass(frozen=True, eq=False)
class AbsoluteImaging:
    """Iterative Gauss–Newton in the logarithm of the conductivity, so that it stays positive.

    Minimises ‖(v − f(σ, z))/noise‖² + α²·cost(log σ/σ₀) + (log σ₀/start)² + Σ(log z/start)²,
    with a line search, over the image, its background σ₀ and the contact impedances z.

    Parameters
    ----------
    model
        The forward model; its contact impedances are known, or the start.
    prior
        As of :class:`OneStep`, for the logarithm of the conductivity, or a
        :class:`TotalVariation` or :class:`Sparse`. NOSER takes the Jacobian at the start.
    alpha
        Hyper-parameter; it enters squared. Values have unit noise here, so that it is the
        inverse of the deviation that the prior expects of the logarithm.
    contacts
        "fixed", "one" common factor or one for "each" electrode.
    steps, tolerance
        It stops after so many steps, or when one gains less than this part of the objective.

    Raises
    ------
    ModelError
        For alpha ≤ 0, a prior that does not fit, or complex contact impedances.
    """

    model: ForwardModel
    prior: PriorLike = "laplace"
    _: KW_ONLY
    alpha: float
    contacts: Contacts = "fixed"
    steps: int = STEPS
    tolerance: float = TOLERANCE

    def __post_init__(self) -> None:
        """Refuse an alpha that is not above zero."""
        check_positive(self.alpha, "alpha")

    def __call__(self, observation: Observation, background: float | None = None) -> Absolute:
        """Conductivity that explains ``observation``.

        Parameters
        ----------
        observation
            What was measured.
        background
            What the medium is expected to have, S or S/m. Without it, the uniform medium that
            explains most is found first, and its contact impedances if they are looked for.

        Raises
        ------
        DataError
            When the observation is not one of this pattern.
        """
        data = observation.whitened(self.model.pattern.n_meas)
        n_cells = len(self.model.mesh.cells)
        image = LinearMap.of_cells(n_cells, n_cells)
        unknowns, begin = medium(self.model, data, image, self.contacts, background)
        descent = descend(
            self._goal(unknowns, data.target),
            begin,
            most=self.steps,
            tolerance=self.tolerance,
            reach=REACH,
        )
        return Absolute.of(unknowns.at(descent.unknowns), descent)

    def _goal(self, unknowns: Unknowns, target: FloatArray) -> Goal:
        mesh, strength, rest = self.model.mesh, self.alpha**2, others(unknowns.n_contacts)
        if hasattr(self.prior, "touching"):
            cost = Sharp(self.prior, mesh, strength, rest)
            return Goal(unknowns.at, target, cost.penalty, cost.energy)
        start = unknowns.at(np.zeros(unknowns.size)).by_contrast
        joint = Joint(penalty_of(self.prior, mesh, start), strength, rest)
        return Goal(unknowns.at, target, lambda _: joint)


@dataclass(frozen=True, eq=False)
class Sharp:
    """The cost of a sharp prior, beside that of background and contacts."""

    prior: Any
    mesh: Mesh
    strength: float
    others: Diagonal

    def penalty(self, unknowns: FloatArray) -> Penalty:
        """The quadratic that touches it at ``unknowns``."""
        image = unknowns[: len(self.mesh.cells)]
        return Joint(self.prior.touching(self.mesh, image), self.strength, self.others)

    def energy(self, unknowns: FloatArray) -> float:
        """The cost of ``unknowns``, edges at their full length."""
        n = len(self.mesh.cells)
        rest = unknowns[n:]
        return float(
            self.strength * self.prior.energy(self.mesh, unknowns[:n])
            + rest @ (self.others.matrix * rest)
        )


def homogeneous(
    model: ForwardModel,
    observation: Observation,
    contacts: Contacts = "fixed",
    background: float | None = None,
) -> Absolute:
    """The uniform conductivity, and contact impedances if wanted, that explain most.

    ``background`` is where the search starts; without it, where the voltages have about the
    right size. Raises DataError when the observation is not one of this pattern.
    """
    return _uniform(model, observation.whitened(model.pattern.n_meas), contacts, background)


def _uniform(
    model: ForwardModel, data: Whitened, contacts: Contacts, background: float | None
) -> Absolute:
    if background is None:
        background = _of_right_size(model, data.target, data.rows)
    unknowns = Unknowns(
        model, LinearMap.of_cells(len(model.mesh.cells), 0), background, contacts, data.rows
    )
    descent = descend(
        Goal(unknowns.at, data.target, lambda _: others(unknowns.n_contacts)),
        Descent.begin(unknowns.size),
        most=STEPS,
        tolerance=TOLERANCE,
        reach=REACH,
    )
    return Absolute.of(unknowns.at(descent.unknowns), descent)


def medium(
    model: ForwardModel,
    data: Whitened,
    image: ImageMap,
    contacts: Contacts,
    background: float | None,
) -> tuple[Unknowns, Descent]:
    """Unknowns of ``image``, and where to begin: no image, on a medium that explains most.

    With a ``background``, on that and with the model's contacts.
    """
    if background is not None:
        unknowns = Unknowns(model, image, background, contacts, data.rows)
        return unknowns, Descent.begin(unknowns.size)
    uniform = _uniform(model, data, contacts, None)
    unknowns = Unknowns(model, image, uniform.background, contacts, data.rows)
    x = np.zeros(unknowns.size)
    if contacts != "fixed":
        ratio = uniform.contact_impedance / model.contact_impedance
        x[-unknowns.n_contacts :] = np.log(ratio[: unknowns.n_contacts])
    weight = np.zeros(unknowns.size)
    weight[image.size :] = others(unknowns.n_contacts).matrix
    return unknowns, Descent(x, weight * x, (), "not begun")


def _of_right_size(model: ForwardModel, target: FloatArray, rows: NDArray[Any]) -> float:
    """Voltages fall as conductivity rises, but for the part of the contacts."""
    unit = rows @ model.at(1.0).voltages
    share = float(target @ unit) / float(unit @ unit)
    return 1.0 / share if share > 0 else 1.0


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
        if alpha is not None:
            check_positive(alpha, "alpha")
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
        image = self._image(data, low)
        for _ in range(_HALVINGS):
            alpha = float(np.sqrt(low * high))
            tried = self._image(data, alpha)
            if tried.descent.steps[-1].misfit <= len(data.target):
                low, image = alpha, tried
            else:
                high = alpha
        return image

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
