"""Rows of a pattern that are turned copies of each other."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from tomoskin.core import FloatArray, IntArray
from tomoskin.pattern import Pattern

_DECIMALS = 9
"""Of an angle, so that equal ones are equal."""


@dataclass(frozen=True, eq=False)
class Turns:
    """Which rows are alike on a uniform round skin whose electrodes stand evenly around it.

    ``orbit`` (k,): rows of one number become each other when all electrodes move on by some;
    ``angle`` (k,) rad by which a row is turned against the first of its orbit. Whether a real
    skin is like that, and which way round its electrodes go, is for the presses to tell.
    """

    orbit: IntArray
    angle: FloatArray

    @classmethod
    def of(cls, pattern: Pattern) -> Self:
        """By the electrodes' numbers alone."""
        table = np.hstack([pattern.drive, pattern.measure])
        row_of = {tuple(electrodes): row for row, electrodes in enumerate(table.tolist())}
        n = pattern.n_electrodes
        orbit, angle = np.arange(len(table)), np.zeros(len(table))
        for steps in range(1, n):
            first = [row_of.get(tuple(e), len(table)) for e in ((table - steps) % n).tolist()]
            earlier = np.array(first) < orbit
            orbit = np.where(earlier, first, orbit)
            angle = np.where(earlier, 2 * np.pi * steps / n, angle)
        return cls(orbit, np.round(angle, _DECIMALS))

    @classmethod
    def none(cls, n_rows: int) -> Self:
        """Where the pattern is not known: one group, nothing turned."""
        return cls(np.zeros(n_rows, dtype=np.int64), np.zeros(n_rows))

    def of_rows(self, rows: IntArray) -> Self:
        """Those of some rows only."""
        return type(self)(self.orbit[rows], self.angle[rows])

    def reversed(self) -> Self:
        """The same with the electrodes the other way round."""
        return replace(self, angle=np.round(-self.angle % (2 * np.pi), _DECIMALS))

    @property
    def any(self) -> bool:
        """Whether there is a turned row at all."""
        return bool(self.angle.any())


def turned(places: FloatArray, angle: float) -> FloatArray:
    """``places`` (n, 2) as a row that is turned by ``angle`` sees them: turned back."""
    c, s = np.cos(angle), np.sin(angle)
    return np.asarray(places @ np.array([[c, -s], [s, c]]))
