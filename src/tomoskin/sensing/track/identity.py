"""Who is who: hypotheses of which touch goes on as which, with their probabilities."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

SURE = 0.8
"""Probability from which an identity is said without any other."""

_RULED_OUT = 0.01
"""Probability below which a hypothesis is dropped."""

_MOST = 8


@dataclass(frozen=True, slots=True)
class IdentityHypothesis:
    """One hypothesis: ``names`` {member: identity}, and the logarithm of its weight."""

    weight: float
    names: Mapping[int, int]

    def exchanged(self, one: int, other: int, odds: float) -> IdentityHypothesis:
        """With two members' names the other way round."""
        names = {**self.names, one: self.names[other], other: self.names[one]}
        return IdentityHypothesis(self.weight + odds, names)


Namings = tuple[IdentityHypothesis, ...]

NOBODY: Namings = (IdentityHypothesis(0.0, {}),)


def begun(namings: Namings, member: int) -> Namings:
    """With a new ``member``, whose identity is its own."""
    return tuple(IdentityHypothesis(n.weight, {**n.names, member: member}) for n in namings)


def ended(namings: Namings, members: Sequence[int]) -> Namings:
    """Without ``members``, who went as what they are held to be."""
    best = namings[0].names
    kept = [n for n in namings if all(n.names[m] == best[m] for m in members)]
    rest = [{m: i for m, i in n.names.items() if m not in members} for n in kept]
    return _bounded(
        [IdentityHypothesis(n.weight, names) for n, names in zip(kept, rest, strict=True)]
    )


def exchanged(namings: Namings, one: int, other: int, odds: float) -> Namings:
    """Where two members may have changed places: log ``odds`` of that."""
    turned = [n.exchanged(one, other, odds) for n in namings]
    return _bounded([*namings, *turned])


def judged(namings: Namings, evidence: Callable[[IdentityHypothesis], float]) -> Namings:
    """The most likely first, by what speaks for each; those that are ruled out are dropped."""
    if len(namings) == 1:
        return namings
    total = {id(n): n.weight + evidence(n) for n in namings}
    most = max(total.values())
    kept = [n for n in namings if total[id(n)] >= most + math.log(_RULED_OUT)]
    return tuple(sorted(kept, key=lambda n: -total[id(n)]))


def probabilities(namings: Namings, evidence: Callable[[IdentityHypothesis], float]) -> list[float]:
    """Of each hypothesis."""
    if len(namings) == 1:
        return [1.0]
    logs = [n.weight + evidence(n) for n in namings]
    odds = [math.exp(value - max(logs)) for value in logs]
    return [value / sum(odds) for value in odds]


def _bounded(namings: Sequence[IdentityHypothesis]) -> Namings:
    """Equal ones as one, the likeliest first, and no more than there may be."""
    sums: dict[tuple[tuple[int, int], ...], float] = {}
    for naming in namings:
        key = tuple(sorted(naming.names.items()))
        sums[key] = _log_sum(sums[key], naming.weight) if key in sums else naming.weight
    most = max(sums.values())
    found = [IdentityHypothesis(weight - most, dict(key)) for key, weight in sums.items()]
    return tuple(sorted(found, key=lambda naming: -naming.weight)[:_MOST])


def _log_sum(one: float, other: float) -> float:
    high, low = max(one, other), min(one, other)
    return high + math.log1p(math.exp(low - high))
