"""Searches that rules share: the least of a curve, and where it crosses a level."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.optimize import brentq, minimize_scalar

from tomoskin.core import ModelError
from tomoskin.inverse.choice import AlphaChoice, Curve
from tomoskin.inverse.spectrum import Spectrum

Quantity = Callable[[float], float]
"""Something of alpha."""

_STRIDE = 8
"""A crossing is looked for between one in so many alphas of the fine grid."""


@dataclass(frozen=True, slots=True)
class Told:
    """What a choice says of itself: its rule, its reason, and what its curve shows."""

    rule: str
    reason: str
    quantity: str


def least(spectrum: Spectrum, quantity: Quantity, told: Told) -> AlphaChoice:
    """Where ``quantity`` is least: on the grid first, as there may be several, then between."""
    alphas = spectrum.alphas
    values = np.array([quantity(float(a)) for a in alphas])
    at = int(values.argmin())
    low, high = np.log(alphas[[max(at - 1, 0), min(at + 1, len(alphas) - 1)]])
    found = minimize_scalar(lambda t: quantity(float(np.exp(t))), bounds=(low, high))
    end = ", at the end of the range" if at in (0, len(alphas) - 1) else ""
    curve = Curve(alphas, values, "alpha", told.quantity, at)
    return AlphaChoice(float(np.exp(found.x)), told.rule, told.reason + end, curve)


def crossing(
    spectrum: Spectrum, quantity: Quantity, level: float, told: Told, hints: tuple[str, str]
) -> AlphaChoice:
    """The largest alpha at which ``quantity`` is ``level``.

    Raises ModelError where it is always above or always below, with one of ``hints``.
    """
    alphas = spectrum.alphas[::_STRIDE]
    values = np.array([quantity(float(a)) for a in alphas])
    crossed = np.flatnonzero(np.diff(values > level))
    if not len(crossed):
        always, hint = ("above", hints[0]) if values[0] > level else ("below", hints[1])
        raise ModelError(
            f"{told.quantity} stays {always} {level:g}: {values.min():.3g} to {values.max():.3g}",
            where=f"rule {told.rule}",
            hint=hint,
        )
    at = int(crossed[-1])
    low, high = (float(np.log(a)) for a in alphas[[at, at + 1]])
    root = float(np.exp(brentq(lambda t: quantity(float(np.exp(t))) - level, low, high)))
    nearest = int(np.abs(np.log(alphas / root)).argmin())
    curve = Curve(alphas, values, "alpha", told.quantity, nearest)
    return AlphaChoice(root, told.rule, told.reason, curve)
