"""Searches that rules share: the least of a curve, and where it crosses a level."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

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


@dataclass(frozen=True, slots=True)
class Level:
    """What a quantity is to reach, and which way it comes there as alpha grows.

    Where it turns back further on, and so has the level once more, is no answer. ``hints`` say
    what to do where it is too large throughout, and where too small.
    """

    value: float
    way: Literal["falling", "rising"]
    hints: tuple[str, str]


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


def crossing(spectrum: Spectrum, quantity: Quantity, level: Level, told: Told) -> AlphaChoice:
    """The largest alpha at which ``quantity`` comes to ``level`` the way that it should.

    Raises ModelError where it never does, with one of the level's hints.
    """
    alphas = spectrum.alphas[::_STRIDE]
    values = np.array([quantity(float(a)) for a in alphas])
    above = values > level.value
    steps = np.diff(above.astype(int))
    crossed = np.flatnonzero(steps == (-1 if level.way == "falling" else 1))
    if not len(crossed):
        where, hint = ("above", level.hints[0]) if above[0] else ("below", level.hints[1])
        raise ModelError(
            f"{told.quantity} {'starts' if steps.any() else 'stays'} {where} {level.value:g}: "
            f"{values.min():.3g} to {values.max():.3g}",
            where=f"rule {told.rule}",
            hint=hint,
        )
    at = int(crossed[-1])
    low, high = (float(np.log(a)) for a in alphas[[at, at + 1]])
    root = float(np.exp(brentq(lambda t: quantity(float(np.exp(t))) - level.value, low, high)))
    nearest = int(np.abs(np.log(alphas / root)).argmin())
    curve = Curve(alphas, values, "alpha", told.quantity, nearest)
    return AlphaChoice(root, told.rule, told.reason, curve)
