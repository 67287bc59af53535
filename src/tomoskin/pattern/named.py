"""The patterns that have a name in a skin file."""

from __future__ import annotations

from collections.abc import Callable

from tomoskin.core import PatternError
from tomoskin.pattern.pattern import Pattern

NAMED: dict[str, Callable[[int], Pattern]] = {
    "adjacent": Pattern.adjacent,
    "opposite": Pattern.opposite,
    "all_pairs": Pattern.all_pairs,
}
"""Patterns by name; ``skip:k`` is understood beside them."""


def named(name: str, n: int) -> Pattern:
    """Pattern of that name on ``n`` electrodes; ``a+b`` joins two of them.

    Raises
    ------
    PatternError
        When the name is not known; the message lists those that are.
    """
    parts = [_one(part.strip(), n) for part in name.split("+")]
    pattern = parts[0]
    for part in parts[1:]:
        pattern = pattern.joined(part)
    return pattern


def _one(name: str, n: int) -> Pattern:
    if name in NAMED:
        return NAMED[name](n)
    kind, _, k = name.partition(":")
    if kind == "skip" and k.isdigit():
        return Pattern.skip(n, int(k))
    raise PatternError(
        f'expected a pattern among {", ".join(NAMED)}, skip:K, or several joined by +, got "{name}"'
    )
