"""What the frames before lead one to expect: touches that go on, and what they left behind."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from tomoskin.core import FloatArray
from tomoskin.sensing.fit.spot import CONTENT, LOG_RADIUS, N_PARAMETERS
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
    def of(cls, spots: FloatArray, covariance: FloatArray, wander: FloatArray) -> Expectation:
        """Of ``spots`` (m, 4) of that ``covariance`` (4m, 4m), with the covariance (3, 3) of what
        they ``wander`` until the next frame; nothing where the covariance is no number."""
        k, n = len(spots), N_PARAMETERS
        own = covariance.reshape(k, n, k, n).diagonal(0, 0, 2)  # (n, n, k)
        own = own[:CONTENT, :CONTENT].transpose(2, 0, 1)
        if not np.isfinite(own).all():
            return cls.none()
        return cls(spots, own + wander)

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


_AWAY, _STRONGER, _WEAKER = 2e-3, 1.1, 0.95
"""A footprint is made anew where its touch is by so many m elsewhere or by so much stronger, and no
weaker: a touch that has just begun is known badly, and so is one that is lifted."""

_OTHERWISE = np.array([1.0, 5e-3, 5e-3, 0.3])
"""What is left lies elsewhere than the touch, m, and has another radius, as a logarithm: standard
deviations. On the textile twin they are 6 mm and 0.27."""

_FALLS, _CREEPS = 0.2, 10.0
"""Seconds in which less is left, and in which more is: that is the sheet's drift, and what grows
faster is a new press."""

_OVERLAP = 1.9
"""Of bells of radii a and b, d apart: exp(−1.9 d²/(a² + b²)), the profile's own to 2 %."""

_FAINT = 0.3
"""Deviations of the noise below which it does not matter what else may be left."""

Shapes = Callable[[FloatArray], FloatArray]
"""(4, n_meas) V of a spot (4,): its change, and the slopes of that by place and radius."""


@dataclass(eq=False, slots=True)
class FootprintChange:
    """Where a touch was, and what it left there.

    Attributes
    ----------
    place
        Where it was first, m.
    spot
        The touch as it is known best, four numbers.
    shapes, rows
        (4, n_meas) V of what is left: the touch's change, and this elsewhere or wider by a
        deviation; and (4, c) as whitened data show them.
    parts
        (4,) of them that are left, as idle frames have told.
    touched
        How strong a touch has stood here since, as a part of that one; 0 where none has.
    quiet
        Seconds of idle frames since.
    """

    place: Sequence[float]
    spot: Sequence[float]
    shapes: FloatArray
    rows: FloatArray
    parts: FloatArray
    touched: float = 1.0
    quiet: float = 0.0

    def is_near(self, spot: Sequence[float]) -> bool:
        """Whether a touch (4,) stands here."""
        return math.dist(self.place, spot[:2]) < RESIDUAL.spacing

    def takes(self, spot: Sequence[float]) -> bool:
        """Whether the touch (4,) that stands here is known better by now than the footprint is."""
        size = spot[CONTENT] / self.spot[CONTENT]
        self.touched, self.quiet = max(self.touched, min(size, 1.0)), 0.0
        return size > (_WEAKER if math.dist(self.spot[:2], spot[:2]) > _AWAY else _STRONGER)

    def doubt(self, since: float) -> float:
        """Deviation of the part that is left, so many seconds ``since`` an idle frame: a touch has
        stood here, or it has faded. In steps of two, so that it is the same for some time."""
        faded = -float(self.parts[0]) * math.expm1(-since / RESIDUAL.recovery)
        doubt = max(RESIDUAL.deviation * self.touched, faded)
        return min(2.0 ** math.ceil(math.log2(doubt)), RESIDUAL.deviation) if doubt > 0 else 0.0

    def learn(self, more: FloatArray, falls: float, creeps: float) -> None:
        """Take what an idle frame shows of the shapes beyond the parts. These fall by such a share
        of it, and creep. What is too much for a residual response is none."""
        if not self.touched:
            size = np.abs(self.parts)
            less = np.clip(falls * more, -size, size)
            self.parts = self.parts + np.where(self.parts * more < 0, less, creeps * more)
        elif RESIDUAL.holds(float(more[0]), self.touched):
            self.parts, self.touched = self.parts + more, 0.0
        self.parts[0] = max(self.parts[0], 0.0)


class ResidualResponse:
    """What touches have left since the baseline has had time to follow.

    It is unknown until nothing touches: then a part of the touch's change counts as noise. Idle
    frames tell what is left, and from then on that is taken from the data. What else there may be
    is how far it has faded since. It fades only, so what grows is a new press.

    Parameters
    ----------
    seconds
        Between frames.
    """

    def __init__(self, seconds: float) -> None:
        self._seconds, self._since = seconds, 0.0
        self._feet: list[FootprintChange] = []
        self._matrix = self._left = np.zeros((0, 0))
        self._doubts: tuple[float, ...] | None = None
        self._known: list[FloatArray] | None = None

    def after(self, spots: FloatArray, shapes: Shapes) -> None:
        """Take a frame in which touches ``spots`` (k, 4) were."""
        self._since += self._seconds
        for spot in spots.tolist():
            own = next((foot for foot in reversed(self._feet) if foot.is_near(spot)), None)
            if own is None:
                made, rows = self._made(shapes(np.array(spot)))
                own = FootprintChange(spot[:2], spot, made, rows, np.zeros(len(made)))
                self._feet = [*self._feet, own][-RESIDUAL.most :]
            elif own.takes(spot):
                own.spot, (own.shapes, own.rows) = spot, self._made(shapes(np.array(spot)))

    def _made(self, shapes: FloatArray) -> tuple[FloatArray, FloatArray]:
        """What is left, in V and whitened: slopes are without what they have of the change."""
        made = _OTHERWISE[:, None] * shapes
        rows = made @ self._matrix.T
        along = rows[1:] @ rows[0] / max(float(rows[0] @ rows[0]), 1e-300)
        for own in (made, rows):
            own[1:] -= np.outer(along, own[0])
        self._doubts = self._known = None
        return made, rows

    def without(self, data: FloatArray) -> FloatArray:
        """``data`` (n_meas,) V less what is known to be left."""
        if self._known is None:
            self._known = [foot.parts @ foot.shapes for foot in self._feet if foot.parts.any()]
        for known in self._known:
            data = data - known
        return data

    def beneath(self, x: float, y: float, radius: float) -> float:
        """Content that is left where a touch of this ``radius`` stands: two bells overlap."""
        total = 0.0
        for foot in self._feet:
            if foot.parts[0]:
                width = radius**2 + math.exp(2 * foot.spot[LOG_RADIUS])
                away = math.dist((x, y), foot.spot[:2])
                total += foot.parts[0] * foot.spot[CONTENT] * math.exp(-_OVERLAP * away**2 / width)
        return total

    def directions(self, matrix: FloatArray) -> FloatArray:
        """(k, c) of what may be left besides, each as long as its deviation; the same array as
        long as nothing changes. ``matrix`` (c, n_meas) 1/V, from data to whitened data."""
        if matrix is not self._matrix:
            self._matrix, self._doubts = matrix, None
            for foot in self._feet:
                foot.rows = foot.shapes @ matrix.T
        doubts = self.doubts
        if doubts != self._doubts:
            left = [d * foot.rows[0] for d, foot in zip(doubts, self._feet, strict=True)]
            counts = [row for row in left if row @ row > _FAINT**2]
            self._left, self._doubts = np.array(counts).reshape(-1, len(matrix)), doubts
        return self._left

    @property
    def doubts(self) -> tuple[float, ...]:
        """The deviations of what may be left, of each footprint."""
        return tuple([foot.doubt(self._since) for foot in self._feet])

    def doubtful(self, n_meas: int) -> FloatArray:
        """Directions (k, n_meas) V of what may be left, each as long as its deviation."""
        pairs = zip(self.doubts, self._feet, strict=True)
        return np.array([d * foot.shapes[0] for d, foot in pairs if d]).reshape(-1, n_meas)

    def idle(self, data: FloatArray) -> None:
        """Take ``data`` (n_meas,) V of a frame in which nothing touched, less what was known."""
        self._since, self._known = self._seconds, None
        if not self._feet:
            return
        rows = np.concatenate([foot.rows for foot in self._feet])
        sizes = np.repeat([foot.touched or 1.0 for foot in self._feet], len(_OTHERWISE))
        inner = rows @ rows.T
        inner[np.diag_indices_from(inner)] += (RESIDUAL.deviation * sizes) ** -2
        parts = np.linalg.solve(inner, rows @ (self._matrix @ data))
        shares = [-math.expm1(-self._seconds / time) for time in (_FALLS, _CREEPS)]
        for foot, more in zip(self._feet, parts.reshape(-1, len(_OTHERWISE)), strict=True):
            foot.learn(more, *shares)
            foot.quiet += self._seconds
        shown = np.array([foot.parts @ foot.rows for foot in self._feet])
        faint = np.square(shown).sum(axis=1) <= 1.0
        faint &= np.array([foot.quiet for foot in self._feet]) >= RESIDUAL.gone
        if np.square(shown[faint].sum(axis=0)).sum() <= 1.0:  # those of one slide add up
            self._feet = [foot for foot, over in zip(self._feet, faint, strict=True) if not over]
