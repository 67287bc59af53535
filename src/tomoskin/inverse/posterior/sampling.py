"""A random walk over placements of regions, from the posterior's law (reversible jumps)."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from tomoskin.core import FloatArray, ModelError
from tomoskin.inverse.iterative.shapes import LESS, MORE
from tomoskin.inverse.posterior.placement import Placement
from tomoskin.inverse.posterior.stars import N_PARAMETERS

_JUMP, _KIND, _MEDIUM = 0.2, 0.03, 0.05
"""Parts of the steps that add or drop a region, change its kind, or change the background."""

_LENGTHS = (0.3, 0.8, 1.6)
"""Lengths of a region's steps, over its deviation in the posterior."""

_STRETCH = 250
"""Steps with the same law of proposals; at the end of each it is renewed."""


def walk(begin: Placement, steps: int, rng: np.random.Generator) -> Iterator[Placement]:
    """Placements after each of so many steps (Metropolis et al. 1953; Green 1995).

    A region moves along what its data leave open: by the normal law that touches the posterior
    where a stretch of the walk begins. Every proposal is judged by the complete forward model.
    """
    here, laws = begin, _laws(begin)
    for step in range(steps):
        if step and step % _STRETCH == 0:
            laws = _laws(here)
        there, bonus = _proposed(here, laws, rng)
        if there is not None and _accepted(here, there, bonus, rng):
            if len(there.kinds) != len(here.kinds):
                laws = _laws(there)
            here = there
        yield here


def _accepted(here: Placement, there: Placement, bonus: float, rng: np.random.Generator) -> bool:
    try:
        gain = 0.5 * (here.objective - there.objective) + bonus
    except ModelError:  # no model has such a conductivity
        return False
    return bool(np.log(rng.random()) < gain)


def _laws(here: Placement) -> list[FloatArray]:
    """(9, 9) factor of the covariance of each region's numbers, the others held."""
    precision, n = here.precision, N_PARAMETERS
    blocks = [precision[i * n : (i + 1) * n, i * n : (i + 1) * n] for i in range(len(here.kinds))]
    return [np.linalg.inv(np.linalg.cholesky(block)).T for block in blocks]


def _proposed(
    here: Placement, laws: list[FloatArray], rng: np.random.Generator
) -> tuple[Placement | None, float]:
    """A placement, and the logarithm of what its proposal adds to the ratio of densities."""
    kind_of_step, n = rng.random(), len(here.kinds)
    if kind_of_step < _JUMP:
        return _added(here, rng) if rng.random() < 0.5 else _dropped(here, rng)
    if kind_of_step < _JUMP + _MEDIUM or not n:
        return _moved(here, -1, 0.3 * here.among.drift * rng.standard_normal()), 0.0
    i = int(rng.integers(n))
    if kind_of_step < _JUMP + _MEDIUM + _KIND:
        other = tuple(LESS + MORE - k if j == i else k for j, k in enumerate(here.kinds))
        return here.among.place(other, here.unknowns), 0.0
    length = rng.choice(_LENGTHS) / np.sqrt(N_PARAMETERS) * 1.5
    part = slice(i * N_PARAMETERS, (i + 1) * N_PARAMETERS)
    return _moved(here, part, length * (laws[i] @ rng.standard_normal(N_PARAMETERS))), 0.0


def _moved(here: Placement, part: slice | int, by: FloatArray | float) -> Placement:
    unknowns = here.unknowns.copy()
    unknowns[part] += by
    return here.among.place(here.kinds, unknowns)


def _added(here: Placement, rng: np.random.Generator) -> tuple[Placement, float]:
    """One region from the prior: its density cancels, and the number's law stays."""
    star = rng.standard_normal(N_PARAMETERS)
    there = here.with_star(int(rng.choice((LESS, MORE))), star)
    return there, float(0.5 * star @ star + np.log(here.among.expected / len(there.kinds)))


def _dropped(here: Placement, rng: np.random.Generator) -> tuple[Placement | None, float]:
    """The reverse; nothing where there is no region."""
    n = len(here.kinds)
    if not n:
        return None, 0.0
    i = int(rng.integers(n))
    star = here.stars[i]
    return here.without(i), -float(0.5 * star @ star + np.log(here.among.expected / n))
