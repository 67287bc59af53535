"""Labelled presses, checked."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Self

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.linalg import cho_factor, cho_solve

from tomoskin.core import DataError, FloatArray, IntArray
from tomoskin.learning.touch.gaussian_process import nearness
from tomoskin.sensing.segment import Region

_FEWEST = 6
_SHOWN = 10
_BESIDE = 0.05
"""A label may lie so far beyond the outline, in radii of the region: it is taken for its rim."""

_FARTHEST = 10.0
"""m; a label farther out than any sheet is in another unit."""

_LONGEST = 0.1
"""m; a lag that is longer is in another unit."""

_MOST = 1e12
"""No instrument has a unit in which a change is a larger number: it counts as missing."""

_LEAST_CHANGE = 1e-100
"""Nor one in which all changes are smaller."""


@dataclass(frozen=True, eq=False)
class Presses:
    """Frames of a single touch each, in the order in which they were made.

    ``dv`` (n, n_meas) V or instrument units, NaN where a value is missing; ``xy`` (n, 2) m;
    ``strength`` (n,) in any unit, or None. ``spread`` (n, 2, 2) m² covariance of the labels where
    they were estimated, None where they are all known. ``slide_lag`` m by which the sheet lags
    behind a finger that slides, None where none did. ``modelled``: whether the labels are those
    of the skin's model, and say no more than touches that are fitted to it.
    """

    dv: FloatArray
    xy: FloatArray
    strength: FloatArray | None = None
    spread: FloatArray | None = None
    slide_lag: float | None = None
    modelled: bool = False

    @classmethod
    def checked(
        cls,
        dv: ArrayLike,
        xy: ArrayLike,
        strength: ArrayLike | None = None,
        spread: ArrayLike | None = None,
        *,
        slide_lag: float | None = None,
        modelled: bool = False,
    ) -> Self:
        """Check the shapes and labels.

        Raises
        ------
        DataError
            For shapes that do not belong together, labels that are not finite, too few presses,
            a lag that no sheet has.
        """
        if slide_lag is not None and not 0 <= slide_lag <= _LONGEST:
            raise DataError(f"expected a slide_lag from 0 to {_LONGEST} m, got {slide_lag:g}")
        presses = replace(cls.of_more(dv, xy, strength), slide_lag=slide_lag, modelled=modelled)
        if spread is not None:
            presses = replace(presses, spread=_checked_spread(spread, len(presses)))
        if len(presses) < _FEWEST:
            raise DataError(
                f"expected at least {_FEWEST} labelled presses, got {len(presses)}",
                hint="label more presses: ten are a start, fifty are good",
            )
        return presses

    @classmethod
    def of_more(cls, dv: ArrayLike, xy: ArrayLike, strength: ArrayLike | None = None) -> Self:
        """The same for presses that are added to others, be they few."""
        data, labels = frames(dv), np.asarray(xy, dtype=np.float64)
        if labels.shape != (len(data), 2):
            raise DataError(f"expected xy of shape ({len(data)}, 2), got {labels.shape}")
        wrong = ~(np.abs(labels) <= _FARTHEST).all(axis=1)
        bad = np.flatnonzero(wrong)
        _name(bad, "have no label within 10 m", "give labels in metres")
        if strength is None:
            return cls(data, labels)
        force = np.asarray(strength, dtype=np.float64)
        if force.shape != (len(data),) or not np.isfinite(force).all():
            raise DataError(f"expected {len(data)} finite strengths, got shape {force.shape}")
        return cls(data, labels, force)

    def __len__(self) -> int:
        """The number of labelled presses."""
        return len(self.dv)

    def first(self, count: int) -> Self:
        """The first ``count`` of these presses."""
        strength = None if self.strength is None else self.strength[:count]
        spread = None if self.spread is None else self.spread[:count]
        dv, xy = self.dv[:count], self.xy[:count]
        return replace(self, dv=dv, xy=xy, strength=strength, spread=spread)

    def within(self, region: Region) -> Self:
        """These presses; DataError, with the rows, where labels lie outside the region."""
        outside = np.flatnonzero(region.beyond(self.xy) > _BESIDE * region.unit)
        _name(
            outside,
            "have labels outside the skin",
            "give labels in metres, measured from the origin of the skin",
        )
        return self

    def and_then(self, other: Self) -> Self:
        """These, then the ``other`` ones. Raises DataError where the rows differ in number."""
        if other.dv.shape[1] != self.dv.shape[1]:
            raise DataError(f"expected {self.dv.shape[1]} rows, got {other.dv.shape[1]}")
        both = self.strength is not None and other.strength is not None
        strength = np.append(self.strength, other.strength) if both else None  # type: ignore[arg-type]
        dv, xy = np.vstack([self.dv, other.dv]), np.vstack([self.xy, other.xy])
        if self.spread is None and other.spread is None:
            return replace(self, dv=dv, xy=xy, strength=strength)
        spread = np.concatenate([self.spreads, other.spreads])
        return replace(self, dv=dv, xy=xy, strength=strength, spread=spread)

    @property
    def spreads(self) -> FloatArray:
        """(n, 2, 2) m² covariance of the labels, 0 where they are known."""
        return np.zeros((len(self), 2, 2)) if self.spread is None else self.spread


def _checked_spread(spread: ArrayLike, n: int) -> FloatArray:
    given = np.asarray(spread, dtype=np.float64)
    if given.shape != (n, 2, 2) or not np.isfinite(given).all():
        raise DataError(f"expected {n} finite covariances of labels (n, 2, 2), got {given.shape}")
    return given


def frames(dv: ArrayLike, n_meas: int | None = None) -> FloatArray:
    """(n, n_meas) float64 of one frame or of many; DataError where it is anything else."""
    data = np.asarray(dv)
    if data.dtype.kind not in "biuf":
        raise DataError(f"expected real numbers as dv, got {data.dtype}")
    data = np.atleast_2d(data).astype(np.float64)
    if data.ndim != 2 or n_meas not in (None, data.shape[1]):
        raise DataError(f"expected dv of shape (n, {n_meas or 'n_meas'}), got {data.shape}")
    return np.where(np.abs(data) <= _MOST, data, np.nan)


def labelled_touches(
    dv: ArrayLike, xy: ArrayLike | None, n_meas: int
) -> tuple[FloatArray, FloatArray]:
    """Frames (n, n_meas) and their labels (n, 2) m, rows of NaN where there is none."""
    data = frames(dv, n_meas)
    labels = np.full((len(data), 2), np.nan) if xy is None else np.asarray(xy, dtype=np.float64)
    if labels.shape != (len(data), 2):
        raise DataError(f"expected xy of shape ({len(data)}, 2), got {labels.shape}")
    return data, labels


def _name(rows: ArrayLike, what: str, hint: str = "") -> None:
    bad = np.asarray(rows)
    if len(bad):
        shown = ", ".join(map(str, bad[:_SHOWN])) + (", …" if len(bad) > _SHOWN else "")
        raise DataError(f"{len(bad)} presses {what}", where=f"press {shown}", hint=hint)


_MOST_MISSING = 0.5
"""A row that is missing in more than this part of the presses is not used."""

_SHRINK = 0.1
"""Part of the covariance that is taken as diagonal when holes are filled."""


@dataclass(frozen=True, eq=False)
class Features:
    """arsinh(dv / scale) of the rows that say something.

    A row's scale is the geometric mean of its own median size and that of all rows: weak rows are
    lifted, but not to the level of strong ones. The inverse hyperbolic sine is linear below the
    scale and logarithmic above, so that a heavy tail weighs little (Johnson 1949, the S_U family).

    Attributes
    ----------
    rows
        (k,) rows of the pattern that are used.
    scale
        (k,) V or instrument units.
    mean, covariance
        (k,), (k, k) of the features over the presses, by which holes are filled.
    """

    rows: IntArray
    scale: FloatArray
    mean: FloatArray
    covariance: FloatArray

    @classmethod
    def of(cls, dv: FloatArray) -> Self:
        """Features for presses (n, n_meas), NaN where a value is missing.

        Raises
        ------
        DataError
            When no row changes from press to press.
        """
        rows = np.flatnonzero(_changing(dv))
        if not len(rows):
            raise DataError(
                f"expected data that change from press to press, got {len(dv)} identical presses"
            )
        used = dv[:, rows]
        scale = _scales(np.abs(used))
        squashed = np.arcsinh(used / scale)
        mean = np.asarray(np.nanmean(squashed, axis=0))
        residual = np.nan_to_num(squashed - mean)
        covariance = residual.T @ residual / len(dv)
        diagonal = np.diag(np.diag(covariance))
        return cls(rows, scale, mean, (1 - _SHRINK) * covariance + _SHRINK * diagonal)

    def __call__(self, dv: FloatArray) -> FloatArray:
        """(n, k) features of frames (n, n_meas); a missing value becomes the likeliest one.

        Raises DataError for a frame in which every used value is missing.
        """
        squashed = np.arcsinh(dv[:, self.rows] / self.scale)
        holes = ~np.isfinite(squashed)
        if holes.all(axis=1).any():
            row = int(np.argmax(holes.all(axis=1)))
            raise DataError("holds no finite value in a row that is used", where=f"frame {row}")
        for frame in np.flatnonzero(holes.any(axis=1)):
            self._fill(squashed[frame], holes[frame])
        return np.asarray(squashed)

    def _fill(self, values: FloatArray, hole: NDArray[np.bool_]) -> None:
        """Put the conditional mean of a Gaussian, given the other values, into the holes."""
        finite = ~hole
        values[hole] = self.mean[hole] + (values[finite] - self.mean[finite]) @ _gain(
            self, hole.tobytes()
        )


@lru_cache(maxsize=4)
def _gain(features: Features, holes: bytes) -> FloatArray:
    """(finite, missing): by which values that are missing follow the others. The same rows are
    missing in many frames."""
    hole = np.frombuffer(holes, dtype=np.bool_)
    covariance = features.covariance
    known = cho_factor(covariance[np.ix_(~hole, ~hole)])
    return np.asarray(cho_solve(known, covariance[np.ix_(~hole, hole)]))


def _scales(sizes: FloatArray) -> FloatArray:
    """(k,) from ``sizes`` (n, k); a row that is mostly 0 has its mean for a median."""
    own = np.nanmedian(sizes, axis=0)
    own = np.where(own > 0, own, np.nanmean(sizes, axis=0))
    return np.asarray(np.sqrt(own * np.median(own)))


def _changing(dv: FloatArray) -> NDArray[np.bool_]:
    finite = np.isfinite(dv)
    present = finite.mean(axis=0) > 1 - _MOST_MISSING
    high = np.where(finite, dv, -np.inf).max(axis=0)
    low = np.where(finite, dv, np.inf).min(axis=0)
    return np.asarray(present & (high - low > _LEAST_CHANGE))


_NEAR = 0.3
"""Radius of what is called the same place, in radii of the region."""

_LEAST = 1e-12


@dataclass(frozen=True, eq=False)
class Strength:
    """A local power law: log strength = a + b (log size − log usual size at the place).

    ``positions`` (n, 2); ``sizes`` (n,) log root mean square of each press; ``labels`` (n,) log
    strength, or None; ``exponent`` b.
    """

    positions: FloatArray
    sizes: FloatArray
    labels: FloatArray | None
    exponent: float

    @classmethod
    def of(cls, presses: Presses, positions: FloatArray) -> Self:
        """Learn from presses whose left-out places are ``positions`` (n, 2), in radii."""
        sizes = _size(presses.dv)
        if presses.strength is None:
            return cls(positions, sizes, None, 1.0)
        labels = np.log(np.maximum(presses.strength, _LEAST))
        plain = cls(positions, sizes, labels, 0.0)
        x = sizes - plain.usual(positions, sizes)
        y = labels - plain.usual(positions, labels)
        exponent = float(x @ y) / max(float(x @ x), _LEAST)
        return cls(positions, sizes, labels, exponent)

    def __call__(self, dv: FloatArray, positions: FloatArray) -> FloatArray:
        """(n,) strengths of frames ``dv`` (n, n_meas) whose touch is at ``positions`` (n, 2)."""
        beyond = self.exponent * (_size(dv) - self.usual(positions, self.sizes))
        middle = 0.0 if self.labels is None else self.usual(positions, self.labels)
        return np.asarray(np.exp(middle + beyond))

    def usual(self, positions: FloatArray, values: FloatArray) -> FloatArray:
        """(m,) mean of the presses' ``values`` (n,) about ``positions`` (m, 2)."""
        return mean_about(positions, self.positions, values)


def mean_about(positions: FloatArray, presses: FloatArray, values: FloatArray) -> FloatArray:
    """(m, …) mean of the ``values`` (n, …) of ``presses`` (n, 2) about ``positions`` (m, 2), in
    radii of the region."""
    near = nearness(positions, presses, _NEAR) + _LEAST
    return np.asarray(np.tensordot(near / near.sum(axis=1, keepdims=True), values, 1))


_ALIKE = 0.28
"""Deviation of the logarithm of presses' sizes about those near by, below which they were about
equally hard: 0.15 for one force on the twin's textile disc (nine in ten of sets of ten presses
below 0.26), 0.25 for two of which one is twice the other (seeds 17 and 37)."""


def equally_hard(presses: Presses, places: FloatArray) -> bool:
    """Whether presses at ``places`` (n, 2), in radii, were all about equally hard.

    By their labels, else by how large each is beside the others near by.
    """
    size = _size(presses.dv)
    if presses.strength is not None:
        return bool(np.log(np.maximum(presses.strength, _LEAST)).std() < _ALIKE)
    near = nearness(places, places, _NEAR)
    np.fill_diagonal(near, 0.0)
    beyond = size - near @ size / np.maximum(near.sum(axis=1), _LEAST)
    return bool(beyond[near.sum(axis=1) > _LEAST].std() < _ALIKE)


def _size(dv: FloatArray) -> FloatArray:
    return np.asarray(0.5 * np.log(np.nanmean(dv**2, axis=1) + _LEAST))
