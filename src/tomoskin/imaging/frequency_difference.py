"""Multi-frequency imaging: what one frequency shows that another does not."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tomoskin.core import ComplexArray, DataError, Image, ModelError
from tomoskin.imaging.linear.one_step import OneStep
from tomoskin.model.forward import ForwardModel
from tomoskin.model.prior import PriorLike


def simple_change(voltages: NDArray[Any], reference: NDArray[Any]) -> ComplexArray:
    """v(f) − v(f₀): all that changes with the frequency, the background included."""
    return np.asarray(voltages - reference, dtype=np.complex128)


def weighted_change(voltages: NDArray[Any], reference: NDArray[Any]) -> ComplexArray:
    """v(f) − a v(f₀), with a = ⟨v(f), v(f₀)⟩ / ⟨v(f₀), v(f₀)⟩ (Jun, Lee, Woo & Seo 2009).

    What changes as the background does drops out, and with it most of what is wrong with the
    model's shape: what remains has another spectrum than the background.
    """
    power = np.vdot(reference, reference)
    if not power:
        raise DataError("the voltages at the reference frequency are zero")
    return simple_change(voltages, np.vdot(reference, voltages) / power * reference)


CHANGES = {"simple": simple_change, "weighted": weighted_change}
"""Kinds of difference between frequencies."""


class FrequencyDifference:
    """Images of one scan at several frequencies against one of them; no untouched scan is needed.

    Parameters
    ----------
    models
        Frequency, Hz → its model, with the contact impedance at that frequency. All have one
        mesh and one pattern.
    admittivity
        Frequency → background σ + jωε, S or S/m, at which its model is linearised.
    reference
        The frequency that the others are compared with.
    kind
        "simple" or "weighted", see :func:`simple_change` and :func:`weighted_change`. With
        "weighted", an image is the change at f less that at the reference in its proportion:
        δγ(f) − (γ(f)/γ(f₀)) δγ(f₀).
    prior, alpha
        As of :class:`OneStep`.

    Raises
    ------
    ModelError
        For fewer than two frequencies, one that is not above 0, a reference or background that
        is missing, meshes or patterns that differ, or an unknown kind.
    """

    def __init__(
        self,
        models: Mapping[float, ForwardModel],
        admittivity: Mapping[float, complex],
        *,
        reference: float,
        kind: str = "weighted",
        prior: PriorLike = "noser",
        alpha: float,
    ) -> None:
        _check(models, admittivity, reference)
        if kind not in CHANGES:
            raise ModelError(f'expected a kind among {", ".join(CHANGES)}, got "{kind}"')
        self.reference = reference
        self.kind = kind
        self.operators = {
            f: OneStep(model, prior, alpha=alpha, conductivity=admittivity[f])
            for f, model in models.items()
            if f != reference
        }

    def __call__(self, voltages: Mapping[float, NDArray[Any]]) -> dict[float, Image]:
        """Complex image at every frequency but the reference, of (n_meas,) V at each.

        Raises
        ------
        DataError
            When a frequency is missing, or the data do not fit.
        """
        missing = [f for f in (self.reference, *self.operators) if f not in voltages]
        if missing:
            raise DataError(f"expected voltages at {missing[0]:g} Hz, got none")
        base = self._checked(voltages, self.reference)
        change = CHANGES[self.kind]
        return {
            f: operator(change(self._checked(voltages, f), base))
            for f, operator in self.operators.items()
        }

    def _checked(self, voltages: Mapping[float, NDArray[Any]], frequency: float) -> NDArray[Any]:
        any_operator = next(iter(self.operators.values()))
        try:
            return any_operator.check(np.asarray(voltages[frequency]))
        except DataError as error:
            raise DataError(error.message, where=f"{frequency:g} Hz", hint=error.hint) from error


def _check(
    models: Mapping[float, ForwardModel], admittivity: Mapping[float, complex], reference: float
) -> None:
    check_frequencies(models)
    if len(models) < 2:
        raise ModelError(f"expected at least 2 frequencies, got {len(models)}")
    if reference not in models:
        raise ModelError(f"expected a model at the reference of {reference:g} Hz, got none")
    bare = [f for f in models if f not in admittivity]
    if bare:
        raise ModelError(f"expected the background's admittivity at {bare[0]:g} Hz, got none")


def check_frequencies(models: Mapping[float, ForwardModel]) -> None:
    """Raise ModelError unless frequencies are above 0 and models share mesh and pattern."""
    for frequency in models:
        if not (np.isfinite(frequency) and frequency > 0):
            raise ModelError(f"expected frequencies above 0 Hz, got {frequency}")
    if len({(m.mesh.identity, m.pattern.identity) for m in models.values()}) > 1:
        raise ModelError("expected one mesh and one pattern for all frequencies, got several")
