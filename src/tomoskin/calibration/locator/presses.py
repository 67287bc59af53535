"""Labelled presses, checked."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import ArrayLike

from tomoskin.core import DataError, FloatArray
from tomoskin.touch import Region

_FEWEST = 6
_SHOWN = 10
_BESIDE = 0.05
"""A label may lie so far beyond the outline, in radii of the region: it is taken for its rim."""


@dataclass(frozen=True, eq=False)
class Presses:
    """Frames of a single touch each, in the order in which they were made.

    ``dv`` (n, n_meas) V or instrument units, NaN where a value is missing; ``xy`` (n, 2) m;
    ``strength`` (n,) in any unit, or None.
    """

    dv: FloatArray
    xy: FloatArray
    strength: FloatArray | None = None

    @classmethod
    def of(cls, dv: ArrayLike, xy: ArrayLike, strength: ArrayLike | None = None) -> Self:
        """Check the shapes and labels.

        Raises
        ------
        DataError
            For shapes that do not belong together, labels that are not finite, too few presses.
        """
        presses = cls.of_more(dv, xy, strength)
        if len(presses) < _FEWEST:
            raise DataError(
                f"expected at least {_FEWEST} labelled presses, got {len(presses)}",
                hint="ten are a start, fifty are good",
            )
        return presses

    @classmethod
    def of_more(cls, dv: ArrayLike, xy: ArrayLike, strength: ArrayLike | None = None) -> Self:
        """The same for presses that are added to others, be they few."""
        data, labels = frames(dv), np.asarray(xy, dtype=np.float64)
        if labels.shape != (len(data), 2):
            raise DataError(f"expected xy of shape ({len(data)}, 2), got {labels.shape}")
        _name(np.flatnonzero(~np.isfinite(labels).all(axis=1)), "have labels that are not finite")
        if strength is None:
            return cls(data, labels)
        force = np.asarray(strength, dtype=np.float64)
        if force.shape != (len(data),) or not np.isfinite(force).all():
            raise DataError(f"expected {len(data)} finite strengths, got shape {force.shape}")
        return cls(data, labels, force)

    def __len__(self) -> int:
        """Number of presses."""
        return len(self.dv)

    def within(self, region: Region) -> Self:
        """These presses; DataError, with the rows, where labels lie outside the region."""
        outside = np.flatnonzero(region.beyond(self.xy) > _BESIDE * region.unit)
        _name(outside, "have labels outside the skin", "labels are in metres, from its origin")
        return self

    def and_then(self, other: Self) -> Self:
        """These, then the ``other`` ones. Raises DataError where the rows differ in number."""
        if other.dv.shape[1] != self.dv.shape[1]:
            raise DataError(f"expected {self.dv.shape[1]} rows, got {other.dv.shape[1]}")
        both = self.strength is not None and other.strength is not None
        strength = np.append(self.strength, other.strength) if both else None  # type: ignore[arg-type]
        return type(self)(np.vstack([self.dv, other.dv]), np.vstack([self.xy, other.xy]), strength)


def frames(dv: ArrayLike, n_meas: int | None = None) -> FloatArray:
    """(n, n_meas) float64 of one frame or of many; DataError where it is anything else."""
    data = np.asarray(dv)
    if data.dtype.kind not in "biuf":
        raise DataError(f"expected real numbers as dv, got {data.dtype}")
    data = np.atleast_2d(data).astype(np.float64)
    if data.ndim != 2 or n_meas not in (None, data.shape[1]):
        raise DataError(f"expected dv of shape (n, {n_meas or 'n_meas'}), got {data.shape}")
    return np.where(np.isfinite(data), data, np.nan)


def _name(rows: ArrayLike, what: str, hint: str = "") -> None:
    bad = np.asarray(rows)
    if len(bad):
        shown = ", ".join(map(str, bad[:_SHOWN])) + (", …" if len(bad) > _SHOWN else "")
        raise DataError(f"{len(bad)} presses {what}", where=f"press {shown}", hint=hint)
