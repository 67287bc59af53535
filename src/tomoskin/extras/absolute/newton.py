"""Gauss–Newton with a line search, for any prior that the one-step operators know."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from scipy.linalg import LinAlgError, cho_factor, cho_solve

from tomoskin.core import FloatArray, ModelError
from tomoskin.model.prior import Penalty

_HALVINGS = 12
"""Shorter steps tried before a direction counts as leading nowhere."""


class Point(Protocol):
    """The forward problem at one vector of unknowns."""

    @property
    def predicted(self) -> FloatArray:
        """Predicted values (m,) of unit noise."""

    @property
    def jacobian(self) -> FloatArray:
        """(m, n) their derivative by the unknowns."""


@dataclass(frozen=True)
class Iteration:
    """One iteration: sums of squares after it, and the part of the full step that was taken."""

    misfit: float
    energy: float
    length: float

    @property
    def objective(self) -> float:
        """Misfit and energy together, what each step must lower."""
        return self.misfit + self.energy


@dataclass(frozen=True, eq=False)
class Descent:
    """Where an iteration came to, and how.

    Attributes
    ----------
    unknowns, force
        (n,) the unknowns, and Q times them: an iteration goes on from both.
    steps
        The start, which has length zero, and every step.
    reason
        Why it stopped.
    """

    unknowns: FloatArray
    force: FloatArray
    steps: tuple[Iteration, ...]
    reason: str

    @classmethod
    def begin(cls, n: int) -> Descent:
        """The state before the first step, at zero."""
        return cls(np.zeros(n), np.zeros(n), (), "not begun")

    def __str__(self) -> str:
        """The steps as a table, and why they ended."""
        lines = ["step  objective     misfit     energy  length"]
        lines += [
            f"{i:4d} {s.objective:10.4g} {s.misfit:10.4g} {s.energy:10.4g} {s.length:7.3g}"
            for i, s in enumerate(self.steps)
        ]
        return "\n".join([*lines, f"stopped: {self.reason}"])


@dataclass(frozen=True, eq=False)
class Goal:
    """What an iteration lowers: ‖target − f(x)‖² + cost(x).

    Attributes
    ----------
    forward
        f at x (n,).
    target
        (m,) values of unit noise.
    penalty
        The quadratic that touches the cost at x.
    energy
        The cost at x, where it is not that quadratic itself.
    """

    forward: Callable[[FloatArray], Point]
    target: FloatArray
    penalty: Callable[[FloatArray], Penalty]
    energy: Callable[[FloatArray], float] | None = None


def descend(
    goal: Goal, begin: Descent, *, most: int, tolerance: float, reach: float = np.inf
) -> Descent:
    """Lower ``goal`` from ``begin`` by at most ``most`` steps.

    Each step solves the problem linearised at x, in the space of the measurements, and goes as
    far along as lowers the objective (Nocedal & Wright 2006, 10.3), and no further than changes
    an unknown by ``reach``. It stops when a step gains less than ``tolerance`` of the objective.
    """
    here = _Here(begin.unknowns, begin.force, goal.forward(begin.unknowns))
    steps = [here.step(goal, 0.0)]
    reason = f"reached the limit of {most} steps"
    for _ in range(most):
        moved = _moved(here, goal, reach)
        if moved is None:
            reason = "no step lowers the objective any further"
            break
        here, step = moved
        gain = 1.0 - step.objective / steps[-1].objective
        steps.append(step)
        if gain < tolerance:
            reason = f"the last step lowered the objective by {gain:.1e} of its value"
            break
    return Descent(here.unknowns, here.force, (*begin.steps, *steps), reason)


@dataclass(frozen=True, eq=False)
class _Here:
    """Unknowns, Q times them, and the forward problem there."""

    unknowns: FloatArray
    force: FloatArray
    point: Point

    def step(self, goal: Goal, length: float) -> Iteration:
        residual = goal.target - self.point.predicted
        energy = float(self.unknowns @ self.force)
        if goal.energy is not None:
            energy = goal.energy(self.unknowns)
        return Iteration(float(residual @ residual), energy, length)


def _moved(here: _Here, goal: Goal, reach: float) -> tuple[_Here, Iteration] | None:
    """As far along one Gauss–Newton step as lowers the objective; None if nothing does."""
    x, jacobian = here.unknowns, here.point.jacobian
    rhs = goal.target - here.point.predicted + jacobian @ x
    end, pull = minimiser(goal.penalty(x), jacobian, rhs)
    before = here.step(goal, 0.0).objective
    longest = min(1.0, reach / max(float(np.abs(end - x).max()), 1e-300))
    for halving in range(_HALVINGS):
        length = longest * 0.5**halving
        trial, force = x + length * (end - x), here.force + length * (pull - here.force)
        with suppress(ModelError):  # too far: no model has such a conductivity
            there = _Here(trial, force, goal.forward(trial))
            step = there.step(goal, length)
            if step.objective < before:
                return there, step
    return None


def minimiser(
    penalty: Penalty, jacobian: FloatArray, rhs: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Minimiser x of ‖Jx − rhs‖² + xᵀQx, and Qx.

    With K = JQ⁻¹Jᵀ + 1 it is Q⁻¹Jᵀλ + Nc, where λ = K⁻¹(rhs − JNc), and free images N are fitted
    by generalised least squares, as in :meth:`LinearProblem.operator`; Qx = Jᵀλ.
    """
    spread, gram = penalty.carry(jacobian)
    system = gram + np.eye(len(gram))
    try:
        factor = cho_factor(system, lower=True, overwrite_a=True, check_finite=False)
    except LinAlgError as error:
        raise ModelError("the step cannot be computed: its values are not finite") from error
    free = penalty.free
    if not free.shape[1]:
        dual = cho_solve(factor, rhs, check_finite=False)
        return spread @ dual, jacobian.T @ dual
    response = jacobian @ free
    half = cho_solve(factor, response, check_finite=False)
    part = np.linalg.lstsq(response.T @ half, half.T @ rhs, rcond=None)[0]
    dual = cho_solve(factor, rhs - response @ part, check_finite=False)
    return spread @ dual + free @ part, jacobian.T @ dual
