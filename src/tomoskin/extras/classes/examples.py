"""Labelled examples of classes: their codes, and frames against the skin at rest."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import product
from typing import Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tomoskin.core import DataError, FloatArray, IntArray
from tomoskin.learning import frames

_MOST_FLAGS = 10
"""All combinations are weighed, so each flag doubles the work."""

_LISTED, _MOST_SESSIONS = 8, 1000


@dataclass(frozen=True)
class Codes:
    """Names, and the combinations of them that a frame may show.

    Attributes
    ----------
    names
        Of the classes or flags.
    exclusive
        Whether exactly one holds at a time; otherwise any of them, or none.

    Raises
    ------
    DataError
        For less than two classes, no flag, names that stand twice, more than ten flags.
    """

    names: tuple[str, ...]
    exclusive: bool

    def __post_init__(self) -> None:
        """Check that names differ and that there are classes enough."""
        twice = sorted({name for name in self.names if self.names.count(name) > 1})
        if twice:
            raise DataError(f"expected each name once, got {', '.join(twice)} twice")
        if self.exclusive and len(self.names) < 2:
            only = f' only "{self.names[0]}"' if self.names else " none"
            raise DataError(
                f"expected at least two classes, got{only}",
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
        """(n, f) of classes by name, NaN for "". Raises DataError for a name that is not known."""
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
        match = (self.table == flags[:, None, :]).all(axis=2)
        return np.where(match.any(axis=1), match.argmax(axis=1), -1)

    def text(self, number: int) -> str:
        """A combination in words: names joined by +, "none" where no flag is set."""
        named = [name for name, on in zip(self.names, self.table[number], strict=True) if on]
        return "+".join(named) or "none"


_FEWEST = 3
"""Labelled frames of each state, or with each flag and without it."""


@dataclass(frozen=True, eq=False)
class Examples:
    """Frames ``dv`` (n, n_meas), NaN where a value is missing, and what is known of them.

    ``flags`` (n, f) 0 or 1, a row of NaN where a frame has no label; ``session`` (n,) numbers
    from 0 on, the newest last.
    """

    codes: Codes
    dv: FloatArray
    flags: FloatArray
    session: IntArray

    @classmethod
    def checked(
        cls, codes: Codes, dv: ArrayLike, flags: ArrayLike, session: IntArray | None = None
    ) -> Self:
        """Examples, of one session unless more are given. Raises DataError for arrays that do not
        belong together."""
        data, given = frames(dv), np.asarray(flags, dtype=np.float64)
        if given.shape != (len(data), len(codes.names)):
            expected = (len(data), len(codes.names))
            raise DataError(f"expected flags of shape {expected}, got {given.shape}")
        bad = np.isfinite(given).any(axis=1) & (codes.numbers(given) < 0)
        if bad.any():
            row = int(np.argmax(bad))
            raise DataError(
                f"expected 0 or 1 for each of {', '.join(codes.names)}, got {given[row].tolist()}",
                where=f"frame {row}",
            )
        number = np.zeros(len(data), dtype=np.int64) if session is None else session
        if number.shape != (len(data),) or not np.isin(number, range(_MOST_SESSIONS)).all():
            raise DataError(
                f"expected a session from 0 to {_MOST_SESSIONS - 1} for each of {len(data)} "
                f"frames, got shape {number.shape}"
            )
        return cls(codes, data, given, number)

    def __len__(self) -> int:
        """The number of labelled frames."""
        return len(self.dv)

    @property
    def labelled(self) -> NDArray[np.bool_]:
        """(n,) whether the state of a frame is known."""
        return np.asarray(np.isfinite(self.flags).all(axis=1))

    @property
    def newest(self) -> NDArray[np.bool_]:
        """(n,) whether a frame is of the newest session."""
        return np.asarray(self.session == self.session.max())

    def part(self, chosen: NDArray[np.bool_]) -> Self:
        """Those that are ``chosen`` (n,)."""
        return replace(
            self, dv=self.dv[chosen], flags=self.flags[chosen], session=self.session[chosen]
        )

    @property
    def to_teach(self) -> NDArray[np.bool_]:
        """(n,) labelled frames of the sessions that have all labels; of all, where there is none.

        The few labels of a session that is fitted without most of them count in that fit.
        """
        partly = np.unique(self.session[~self.labelled])
        complete = self.labelled & ~np.isin(self.session, partly)
        return np.asarray(complete if complete.any() else self.labelled)

    def and_then(self, other: Examples) -> Self:
        """These, then the ``other`` ones as a session of their own.

        Raises DataError where the rows or the names differ.
        """
        if other.dv.shape[1] != self.dv.shape[1]:
            raise DataError(f"expected {self.dv.shape[1]} rows, got {other.dv.shape[1]}")
        if other.codes != self.codes:
            raise DataError(
                f"expected the classes {', '.join(self.codes.names)}, "
                f"got {', '.join(other.codes.names)}"
            )
        later = other.session + self.session.max() + 1
        return replace(
            self,
            dv=np.vstack([self.dv, other.dv]),
            flags=np.vstack([self.flags, other.flags]),
            session=np.append(self.session, later),
        )

    def enough(self) -> Self:
        """These, or DataError that names the state that has too few labelled frames."""
        flags = self.flags[self.labelled]
        counts = np.stack([flags.sum(axis=0), (1 - flags).sum(axis=0)])
        if not len(flags):
            raise DataError(
                "expected labelled frames, got none",
                hint="label frames of each state: ten of each are a start",
            )
        if counts.min() < _FEWEST:
            which, flag = np.unravel_index(np.argmin(counts), counts.shape)
            word = "without" if which else "with"
            raise DataError(
                f"expected at least {_FEWEST} labelled frames {word} {self.codes.names[flag]}, "
                f"got {int(counts.min())}",
                hint="label more frames: ten of each are a start",
            )
        return self


def against_rest(pressed: ArrayLike, rest: ArrayLike) -> FloatArray:
    """(n, n_meas) change of each pressed frame against the level of the untouched ones.

    Each press has an untouched frame just before it. Their level is a random walk under white
    noise; how much either is worth follows from the differences between consecutive ones:
    variance q + 2r, covariance of neighbours −r. The steady Kalman smoother of that model (Harvey
    1989, 4.2 and 4.6) averages as many before and after as the drift allows.

    Parameters
    ----------
    pressed, rest
        (n, n_meas) in the order in which they were taken; ``rest[k]`` before ``pressed[k]``.

    Raises
    ------
    DataError
        For shapes that do not belong together, or values at rest that are not finite.
    """
    level = frames(rest)
    data = frames(pressed, level.shape[1])
    if len(data) != len(level) or not np.isfinite(level).all():
        raise DataError(
            f"expected a finite untouched frame for each of {len(data)} presses, got {len(level)}"
        )
    gain = _gain(level)
    before, after = _filtered(level, gain), _filtered(level[::-1], gain)[::-1]
    return np.asarray(data - (before + after - gain * level) / (2 - gain))


def _filtered(level: FloatArray, gain: float) -> FloatArray:
    from scipy.signal import lfilter

    start = (1 - gain) * level[:1]
    return np.asarray(lfilter([gain], [1, gain - 1], level, axis=0, zi=start)[0])


def _gain(level: FloatArray) -> float:
    """Part of a new frame that is believed; 1 where there is nothing to average."""
    steps = np.diff(level, axis=0)
    if len(steps) < 2:
        return 1.0
    white = max(-float(np.mean(steps[1:] * steps[:-1])), 0.0)
    walk = max(float(np.mean(steps**2)) - 2 * white, 0.0)
    if not white:
        return 1.0
    ahead = (walk + np.sqrt(walk**2 + 4 * walk * white)) / 2
    return max(float(ahead / (ahead + white)), 1 / len(level))
