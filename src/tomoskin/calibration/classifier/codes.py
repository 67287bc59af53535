"""What there is to tell apart: states of which one holds, or flags of which any may."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import product
from typing import Self

import numpy as np

from tomoskin.core import DataError, FloatArray, IntArray

_MOST_FLAGS = 10
"""All combinations are weighed, so each flag doubles the work."""

_LISTED = 8


@dataclass(frozen=True)
class Codes:
    """Names, and the combinations of them that a frame may show.

    Attributes
    ----------
    names
        Of the states or flags.
    exclusive
        Whether exactly one holds at a time; otherwise any of them, or none.

    Raises
    ------
    DataError
        For less than two states, no flag, names that stand twice, more than ten flags.
    """

    names: tuple[str, ...]
    exclusive: bool

    def __post_init__(self) -> None:
        """Check the names."""
        twice = sorted({name for name in self.names if self.names.count(name) > 1})
        if twice:
            raise DataError(f"expected each name once, got {', '.join(twice)} twice")
        if self.exclusive and len(self.names) < 2:
            only = f' only "{self.names[0]}"' if self.names else " none"
            raise DataError(
                f"expected at least two states, got{only}",
                hint='label some frames as another state too, such as "idle"',
            )
        if not self.exclusive and not 1 <= len(self.names) <= _MOST_FLAGS:
            raise DataError(f"expected 1 to {_MOST_FLAGS} flags, got {len(self.names)}")

    @classmethod
    def of_labels(cls, labels: Sequence[str]) -> Self:
        """States by name; "" is a frame without a label."""
        return cls(tuple(sorted({str(name) for name in labels} - {""})), exclusive=True)

    @cached_property
    def table(self) -> FloatArray:
        """(k, f) the combinations: 0 or 1 for each name."""
        n = len(self.names)
        rows = np.eye(n) if self.exclusive else np.array(list(product((0.0, 1.0), repeat=n)))
        rows.flags.writeable = False
        return rows

    def flags_of(self, labels: Sequence[str]) -> FloatArray:
        """(n, f) of states by name, NaN for "". Raises DataError for a name that is not known."""
        unknown = sorted({str(name) for name in labels} - {"", *self.names})
        if unknown:
            raise DataError(
                f"unknown state {', '.join(unknown[:_LISTED])}",
                hint=f"known: {', '.join(self.names)}",
            )
        place = {name: row for row, name in enumerate(self.names)}
        nothing = np.full(len(self.names), np.nan)
        return np.array([self.table[place[str(n)]] if str(n) else nothing for n in labels])

    def numbers(self, flags: FloatArray) -> IntArray:
        """(n,) row of ``table`` for each of (n, f) flags, −1 where they are NaN."""
        found = (self.table == flags[:, None, :]).all(axis=2)
        return np.where(found.any(axis=1), found.argmax(axis=1), -1)

    def text(self, number: int) -> str:
        """A combination in words: names joined by +, "none" where no flag is set."""
        named = [name for name, on in zip(self.names, self.table[number], strict=True) if on]
        return "+".join(named) or "none"
