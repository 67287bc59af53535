"""What the frames before lead one to expect: touches that go on, and what they left behind."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Self

import numpy as np

from tomoskin.core import FloatArray
from tomoskin.sensing.fit.spot import CONTENT, N_PARAMETERS
from tomoskin.sensing.track import RESIDUAL

Known = tuple[int | None, ...]
"""Of each of some spots which of the touches that are expected it is; None: a newcomer."""


@dataclass(frozen=True, eq=False)
class Expectation:
    """Touches that go on, each normally distributed. Fingers press and let go within a frame: so
    position and size are expected, and the content is not.

    Attributes
    ----------
    spots
        (m, 4) the most likely.
    covariances
        (m, 3, 3) of the other columns.
    """

    spots: FloatArray
    covariances: FloatArray

    @classmethod
    def none(cls) -> Expectation:
        """Nothing is expected of this frame."""
        return cls(np.zeros((0, N_PARAMETERS)), np.zeros((0, CONTENT, CONTENT)))

    @classmethod
    def of(cls, spots: FloatArray, covariance: FloatArray, wander: Sequence[float]) -> Expectation:
        """Of ``spots`` (m, 4) of that ``covariance`` (4m, 4m), with deviations (3,) of what they
        ``wander`` until the next frame; nothing where the covariance is no number."""
        k, n = len(spots), N_PARAMETERS
        own = covariance.reshape(k, n, k, n).diagonal(0, 0, 2)  # (n, n, k)
        own = own[:CONTENT, :CONTENT].transpose(2, 0, 1)
        if not np.isfinite(own).all():
            return cls.none()
        return cls(spots, own + np.diag(np.square(wander)))

    @cached_property
    def weights(self) -> FloatArray:
        """(m, 3, 3) inverse of the covariances."""
        return np.asarray(np.linalg.inv(self.covariances))

    def away(self, spots: FloatArray, known: Known) -> float:
        """The largest squared deviation, along one column, of ``spots`` (k, 4) from where they are
        expected; of newcomers without bound, and 0 where there are none."""
        numbers = [number for number in known if number is not None]
        if len(numbers) < len(spots):
            return math.inf
        off = spots[:, :CONTENT] - self.spots[numbers, :CONTENT]
        variances = self.covariances.diagonal(axis1=1, axis2=2)[numbers]
        return float((off * off / variances).max(initial=0.0))

    @cached_property
    def log_volumes(self) -> FloatArray:
        """(m,) logarithm of one over the density at the most likely."""
        log_dets = np.linalg.slogdet(self.covariances)[1]
        return np.asarray((CONTENT * math.log(2 * math.pi) + log_dets) / 2)


def newcomers(count: int) -> Known:
    """So many spots of which none was there before."""
    return (None,) * count


def less(known: Known, number: int) -> Known:
    """Those that remain without one of them."""
    return (*known[:number], *known[number + 1 :])


_AWAY, _STRONGER, _WEAKER = 1e-3, 1.1, 0.95
"""A footprint is made anew where its touch is by so many m elsewhere or by so much stronger, and no
weaker: a touch that has just begun is known badly, and so is one that is lifted."""

_FOOTPRINTS = 16
"""Footprints that are kept, the newest."""

_FALLS, _CREEPS = 0.1, 10.0
"""Seconds in which what is left is known to have become less; or more, which is the sheet's drift:
what grows faster is a new press."""

_OTHERWISE = np.array([1.0, 5e-3, 5e-3, 0.3])
"""What is left lies elsewhere than the touch, m, and has another radius, as a logarithm: standard
deviations, as parts of it. On the textile twin, 6 mm and 0.27."""

_LEAST = 1e-6
"""Part below which nothing is left."""

_FAINT, _GONE = 0.3, 0.5
"""Deviations of the noise below which it does not matter what else may be left; and seconds without
a touch after which a footprint is forgotten where less than one is left."""

Shapes = Callable[[FloatArray], FloatArray]
"""(4, n_meas) V of a spot (4,): its change, and the slopes of that by place and radius."""


@dataclass(eq=False, slots=True)
class FootprintChange:
    """Where a touch was, and what it left there.

    Attributes
    ----------
    spot, shapes
        The touch as it was strongest, four numbers; and (4, n_meas) V that what it leaves may be
        made of: its change, and this elsewhere or wider, each by a deviation.
    place
        Where it was first, m.
    parts
        (4,) of these that are left, as frames have told in which nothing touched.
    known
        Whether there have been such frames since.
    quiet
        Seconds of them.
    rows
        (4, c) the shapes as whitened data show them.
    """

    spot: Sequence[float]
    shapes: FloatArray
    place: Sequence[float]
    parts: FloatArray = field(default_factory=lambda: np.zeros(4))
    known: bool = False
    quiet: float = 0.0
    rows: FloatArray | None = None

    @classmethod
    def of(cls, spot: Sequence[float], shapes: FloatArray) -> Self:
        """Of a touch (4,)."""
        return cls(spot, shapes, spot[:2])

    def is_near(self, spot: Sequence[float]) -> bool:
        """Whether a touch (4,) stands here."""
        return math.dist(self.place, spot[:2]) < RESIDUAL.spacing

    def is_outdated(self, spot: Sequence[float]) -> bool:
        """Whether the touch that stands here is known better by now."""
        stronger = spot[CONTENT] / self.spot[CONTENT]
        moved = stronger > _STRONGER or math.dist(self.spot[:2], spot[:2]) > _AWAY
        return moved and stronger > _WEAKER


class ResidualResponse:
    """What touches have left since the baseline has had time to follow: a part of the change that
    each footprint's touch was, about there.

    It is unknown until nothing touches: then it counts as noise. Frames in which nothing touches
    tell it, and from then on it is taken from the data. It fades, so what grows is a new press.

    Parameters
    ----------
    seconds
        Between frames.
    """

    def __init__(self, seconds: float) -> None:
        self._seconds, self._since = seconds, 0.0
        self._feet: list[FootprintChange] = []
        self._doubts: list[float] = []
        self._made_of: list[FloatArray] = []
        self._left = self._matrix = np.zeros((0, 0))

    def after(self, spots: FloatArray, shapes: Shapes) -> None:
        """Take a frame in which touches ``spots`` (k, 4) were."""
        self._since += self._seconds
        for spot in spots.tolist():
            own = next((foot for foot in reversed(self._feet) if foot.is_near(spot)), None)
            if own is None:
                self._feet.append(FootprintChange.of(spot, self._apart(shapes(np.array(spot)))))
                continue
            own.known, own.quiet = False, 0.0
            if own.is_outdated(spot):
                own.spot, own.shapes = spot, self._apart(shapes(np.array(spot)))
                own.rows = None
        del self._feet[:-_FOOTPRINTS]

    def _apart(self, shapes: FloatArray) -> FloatArray:
        """The slopes without what they have of the change itself."""
        own = _OTHERWISE[:, None] * shapes
        change, *slopes = own @ self._matrix.T
        own[1:] -= np.outer(np.array(slopes) @ change / (change @ change), own[0])
        return own

    def without(self, data: FloatArray) -> FloatArray:
        """``data`` (n_meas,) V less what is known to be left."""
        for foot in self._feet:
            if foot.parts.any():
                data = data - foot.parts @ foot.shapes
        return data

    def directions(self, matrix: FloatArray) -> FloatArray:
        """(k, c) of what may be left beyond that, each as long as its deviation; ``matrix``
        (c, n_meas) 1/V, from data to whitened data."""
        rows, doubts = self._rows(matrix), [self._doubt(foot) for foot in self._feet]
        made_of, left = [matrix, *rows], self._left
        if doubts != self._doubts or list(map(id, made_of)) != list(map(id, self._made_of)):
            all_left = [doubt * own[0] for doubt, own in zip(doubts, rows, strict=True)]
            counts = [row for row in all_left if row @ row > _FAINT**2]
            left = np.array(counts).reshape(-1, len(matrix))
            self._doubts, self._made_of, self._left = doubts, made_of, left
        return left

    def _rows(self, matrix: FloatArray) -> list[FloatArray]:
        if matrix is not self._matrix:
            self._matrix = matrix
            for foot in self._feet:
                foot.rows = None
        rows = []
        for foot in self._feet:
            if foot.rows is None:
                foot.rows = foot.shapes @ matrix.T
            rows.append(foot.rows)
        return rows

    def _doubt(self, foot: FootprintChange) -> float:
        """Deviation of the part that is left: in steps of two, so that it is the same for some
        time."""
        if not foot.known:
            return RESIDUAL.deviation
        less = -float(foot.parts[0]) * math.expm1(-self._since / RESIDUAL.recovery)
        steps = math.floor(math.log2(RESIDUAL.deviation / max(less, _LEAST)))
        return RESIDUAL.deviation / 2.0 ** max(steps, 0)

    def idle(self, matrix: FloatArray, data: FloatArray) -> None:
        """Take ``data`` (n_meas,) V of a frame in which nothing touched, less what was known."""
        self._since = self._seconds
        if not self._feet:
            return
        rows = np.concatenate(self._rows(matrix))
        inner = rows @ rows.T
        inner[np.diag_indices_from(inner)] += RESIDUAL.deviation**-2
        more = np.linalg.solve(inner, rows @ (matrix @ data)).reshape(-1, len(_OTHERWISE))
        falls, creeps = (-math.expm1(-self._seconds / time) for time in (_FALLS, _CREEPS))
        kept = []
        for foot, own in zip(self._feet, more, strict=True):
            gain = (falls if own[0] < 0 else creeps) if foot.known else 1.0
            parts = foot.parts + gain * own
            foot.parts = parts if parts[0] > _LEAST else 0.0 * parts
            foot.known, foot.quiet = True, foot.quiet + self._seconds
            if foot.quiet < _GONE or np.linalg.norm(foot.parts @ foot.rows) > 1.0:
                kept.append(foot)
        self._feet = kept
