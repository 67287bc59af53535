"""Frames with their states, session by session, checked."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tomoskin.calibration.classifier.codes import Codes
from tomoskin.calibration.locator.presses import frames
from tomoskin.core import DataError, FloatArray, IntArray

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
    def of(cls, codes: Codes, dv: ArrayLike, flags: ArrayLike) -> Self:
        """Examples of one session. Raises DataError for arrays that do not belong together."""
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
        return cls(codes, data, given, np.zeros(len(data), dtype=np.int64))

    def __len__(self) -> int:
        """Number of frames."""
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

    def taught(self) -> Self:
        """Labelled frames of the sessions that have all labels; of all, where there is none.

        The few labels of a session that is fitted without most of them count in that fit.
        """
        partly = np.unique(self.session[~self.labelled])
        whole = self.labelled & ~np.isin(self.session, partly)
        return self.part(whole if whole.any() else self.labelled)

    def and_then(self, other: Examples) -> Self:
        """These, then the ``other`` ones as a session of their own.

        Raises DataError where the rows or the names differ.
        """
        if other.dv.shape[1] != self.dv.shape[1]:
            raise DataError(f"expected {self.dv.shape[1]} rows, got {other.dv.shape[1]}")
        if other.codes != self.codes:
            raise DataError(
                f"expected the states {', '.join(self.codes.names)}, "
                f"got {', '.join(other.codes.names)}"
            )
        later = other.session + self.session.max() + 1
        return replace(
            self,
            dv=np.vstack([self.dv, other.dv]),
            flags=np.vstack([self.flags, other.flags]),
            session=np.append(self.session, later),
        )

    def checked(self) -> Self:
        """These, or DataError that names the state that has too few labelled frames."""
        known = self.flags[self.labelled]
        counts = np.stack([known.sum(axis=0), (1 - known).sum(axis=0)])
        if not len(known):
            raise DataError("expected labelled frames, got none", hint="ten of each are a start")
        if counts.min() < _FEWEST:
            which, flag = np.unravel_index(np.argmin(counts), counts.shape)
            word = "without" if which else "with"
            raise DataError(
                f"expected at least {_FEWEST} labelled frames {word} {self.codes.names[flag]}, "
                f"got {int(counts.min())}",
                hint="ten of each are a start",
            )
        return self
