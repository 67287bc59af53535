"""A touch that begins, drive by drive: evidence of an onset before the scan ends.

The newest sample of each measurement is kept. A touch that began some drives ago shows in the
measurements of these drives, and in no older one. Which drive it was is not known: so each is
tried, and the likelihood ratio of the best one counts (Page 1954; Willsky & Jones 1976). Older
measurements say what all have in common for long, such as a gain. What drives share for a moment,
such as hum, has another phase in each scan: it is no help, and counts as noise.

A touch that moves is a position and a velocity, a radius and a content, and the two amplitudes that
a fit integrates over, of direction and shape. An extended Kalman filter (Jazwinski 1970) takes the
measurements of one drive after the other. So a scan does not tear what moves within it.
"""

from __future__ import annotations

from collections.abc import Generator
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import NamedTuple, Self

import numpy as np
from scipy.linalg.lapack import dpotrf, dpotrs, dtrtrs
from scipy.special import ndtri

from tomoskin.core import FloatArray, IntArray
from tomoskin.sensing.fit.candidates import Candidates
from tomoskin.sensing.fit.problem import Solver
from tomoskin.sensing.fit.solver import SheetDomain
from tomoskin.sensing.fit.spot import CONTENT, LOG_RADIUS, N_PARAMETERS, X, Y
from tomoskin.sensing.fit.spot_fit import SpotPrior
from tomoskin.sensing.track import RESIDUAL, TrackSettings, motion_step

FALSE_AN_HOUR = 0.1
"""False onsets that noise alone may cause."""

_MISSHAPEN = 0.1
"""Part of a touch's change by which the signature of a faint one may be wrong."""

_GRID = 0.004
"""Standard deviation of a position between two candidates, m."""

_ORDERS = 64
"""Sequences of drives whose sizes are kept."""


@dataclass(frozen=True, eq=False)
class DriveEvidence:
    """What each drive tells of a touch at each of n candidates.

    Attributes
    ----------
    spots, signatures
        The candidates, (n, 4) of content 1 and (n, n_meas) V/m².
    precision
        (n_meas, n_meas) 1/V², of the measurements as if drives shared only what stays.
    firsts
        (n_drive,) number of the first measurement of each drive.
    gram, wavers
        (n, n_drive, n_drive) products of the signatures' parts by the precision, and the variance
        of what they match, with all that drives share.
    """

    spots: FloatArray
    signatures: FloatArray
    precision: FloatArray
    firsts: IntArray
    gram: FloatArray
    wavers: FloatArray

    @classmethod
    def making(
        cls, candidates: Candidates, noise: FloatArray, stays: FloatArray, drives: IntArray
    ) -> Generator[None, None, Self]:
        """A piece of work for each drive; ``noise`` of a frame and what ``stays`` from frame to
        frame, (n_meas, n_meas) V², and ``drives`` (n_meas,)."""
        signatures, apart = candidates.signatures, drives[:, None] != drives
        precision = np.asarray(np.linalg.inv(np.where(apart, 0.0, noise) + stays))
        wavering = precision @ (noise + stays) @ precision
        firsts = np.flatnonzero(np.diff(drives, prepend=-1))
        gram, wavers = np.empty((2, len(signatures), len(firsts), len(firsts)))
        for drive, rows in enumerate(_slices(firsts, len(drives))):
            for products, matrix in ((gram, precision), (wavers, wavering)):
                yield
                parts = signatures * (signatures[:, rows] @ matrix[rows])
                products[:, drive] = np.add.reduceat(parts, firsts, axis=1)
        return cls(candidates.spots, signatures, precision, firsts, gram, wavers)

    @cached_property
    def rows(self) -> list[slice]:
        """The measurements of each drive."""
        return _slices(self.firsts, len(self.precision))

    @cached_property
    def blocks(self) -> tuple[IntArray, FloatArray]:
        """(n_drive, m) the measurements of each drive, and (n_drive, m, n) the signatures there; 0
        where a drive has fewer."""
        count = np.diff(self.firsts, append=len(self.precision))
        within = np.arange(count.max())
        every = np.minimum(self.firsts[:, None] + within, len(self.precision) - 1)
        return every, self.signatures.T[every] * (within < count[:, None])[..., None]

    def matched(self, data: FloatArray) -> FloatArray:
        """(n_drive, n) products of the signatures' parts with ``data`` (n_meas,) 1/V."""
        every, signatures = self.blocks
        return np.asarray(np.matmul(data[every][:, None], signatures)[:, 0])

    def sizes(self, order: tuple[int, ...]) -> tuple[FloatArray, FloatArray]:
        """(n_drive, n) squared deviations of candidates of content 1 in the first one, two, …
        drives of an ``order`` (n_drive,), and the deviations of what they match there."""
        among = np.argsort(order) <= np.arange(len(order))[:, None]
        both = (among[:, :, None] & among[:, None]).reshape(len(order), -1).astype(np.float64)
        gram, wavers = (both @ p.reshape(len(p), -1).T for p in (self.gram, self.wavers))
        gram = np.maximum(gram, 1e-300)
        return gram, np.sqrt(np.maximum(gram, wavers))

    def threshold(self, drives_a_second: float, least: float) -> float:
        """Deviations that noise exceeds :data:`FALSE_AN_HOUR` times in an hour; no less than
        ``least``. Each drive tests no more directions than there are measurements."""
        tests = 3600 * drives_a_second * len(self.precision)
        return max(least, float(-ndtri(FALSE_AN_HOUR / tests)))


def _slices(firsts: IntArray, count: int) -> list[slice]:
    ends = [*firsts[1:].tolist(), count]
    return [slice(first, end) for first, end in zip(firsts.tolist(), ends, strict=True)]


class Onset(NamedTuple):
    """A touch that has begun: its middle (2,) m and the covariance (2, 2) m² of that, the likeliest
    spot (4,), by how many deviations it stands out, and how many drives show it as a whole."""

    middle: FloatArray
    covariance: FloatArray
    spot: FloatArray
    ratio: float
    drives: int


class Initiation:
    """Whether a touch has begun in the newest measurements of an untouched skin, or beside touches
    that are followed.

    Parameters
    ----------
    evidence
        Of the drives.
    threshold
        Deviations from which a touch has begun.
    sign
        Of touches, as in a skin's ``[touch]``.
    """

    def __init__(self, evidence: DriveEvidence, threshold: float, sign: str) -> None:
        self._evidence, self._threshold, self._sign = evidence, threshold, sign
        self.rows = evidence.rows
        self._data = np.zeros(len(evidence.precision))
        self._matched = np.zeros(len(evidence.precision))
        self._sizes = lru_cache(maxsize=_ORDERS)(evidence.sizes)
        self.forget()

    def forget(self) -> None:
        """Begin anew: drives that were read tell nothing."""
        self._order: tuple[int, ...] = ()
        self._since: int | None = None
        self._beside = np.zeros((2, 0, len(self._evidence.spots)))

    @property
    def begun(self) -> bool:
        """Whether a touch has begun that is to be told."""
        return self._since is not None

    def go_on(self, other: Initiation) -> None:
        """Go on where an ``other`` one of the same skin is."""
        self._data, self._order, self._since = other._data, other._order, other._since
        self._beside = other._beside
        self._matched = self._evidence.precision @ self._data

    def push(self, drive: int, data: FloatArray, *, late: bool = False) -> Onset | None:
        """Take the ``data`` (m,) V of a drive of an untouched skin; a touch, once one has begun.
        ``late``: a newer drive is there already, which tells what both show."""
        evidence, rows = self._evidence, self.rows[drive]
        self._matched += evidence.precision[:, rows] @ (data - self._data[rows])
        self._data[rows] = data
        self._order = order = (drive, *(d for d in self._order if d != drive))
        if self._since is not None:
            self._since = min(self._since + 1, len(order) - 1)
        if late or len(order) < len(evidence.firsts):
            return None
        onto = evidence.matched(self._matched)[list(order)].cumsum(axis=0)
        return self._begun(onto, *self._sizes(order))

    def push_beside(self, rows: slice, off: FloatArray, covariance: FloatArray) -> Onset | None:
        """Take by what a drive is ``off`` (m,) V the touches that are followed, with the
        ``covariance`` (m, m) V² of that; a further touch, once one has begun.

        Without one that is white, and each drive tells something new (Willsky & Jones 1976).
        """
        both = np.vstack([off, self._evidence.signatures[:, rows]]).T
        white, _ = dtrtrs(_root(covariance), both, lower=1)
        newest = np.stack([white[:, 0] @ white[:, 1:], np.square(white[:, 1:]).sum(axis=0)])
        beside = np.concatenate([newest[:, None], self._beside], axis=1)
        self._beside = beside = beside[:, : len(self.rows)]
        if self._since is not None:
            self._since = min(self._since + 1, beside.shape[1] - 1)
        onto, size = beside.cumsum(axis=1)
        return self._begun(onto, size, np.sqrt(size))

    def _begun(self, onto: FloatArray, size: FloatArray, deviation: FloatArray) -> Onset | None:
        """A touch, from what the newest one, two, … drives match ``onto`` candidates (k, n), the
        ``size`` of that at a content of 1, and the ``deviation`` of its noise.

        A touch comes down while a drive is read: that drive shows a part of it, and counts for its
        existence but not for its position. So a touch is not told before the drive after that.
        """
        if self._sign != "both":
            onto = np.minimum(onto, 0.0) if self._sign == "decrease" else np.maximum(onto, 0.0)
        ratio = np.abs(onto) / deviation
        if self._since is None:
            best = int(ratio.argmax())
            if ratio.flat[best] < self._threshold:
                return None
            self._since = best // ratio.shape[1]
        if not self._since:
            return None
        newest = self._since - 1
        return self._onset(onto[newest] / size[newest], ratio[newest], self._since)

    def _onset(self, content: FloatArray, ratio: FloatArray, drives: int) -> Onset:
        """The position by all candidates, each as likely as the data say; a strong touch differs
        from the signature of a faint one, which is taken for noise."""
        spots, best = self._evidence.spots, int(np.argmax(ratio))
        doubt = 1.0 + (_MISSHAPEN * ratio[best]) ** 2
        weight = np.exp((ratio**2 - ratio[best] ** 2) / (2.0 * doubt))
        weight /= weight.sum()
        middle = weight @ spots[:, :2]
        away = spots[:, :2] - middle
        covariance = away.T @ (weight[:, None] * away) + _GRID**2 * np.eye(2)
        spot = spots[best].copy()
        spot[CONTENT] = content[best]
        return Onset(middle, covariance, spot, float(ratio[best]), drives)


_TRACK = TrackSettings()

_SWELLS, _GROWS = 0.1, 1.0
"""Standard deviations of the logarithm of the radius, and of the content in parts of it, by which
they wander in a second."""

_OTHERWISE = 0.15
"""Part by which each measurement answers otherwise than the model's, in each drive anew."""

_STEPS = 2
"""Steps of a drive: the response bends."""

_LAGS, _FLOOR = 0.06, 0.0025
"""What a sheet remembers of a touch that moves: seconds by which its response lies behind, and the
standard deviation that no touch goes below, m. Chosen on the textile discs, seed 9100."""

_LEFT = (RESIDUAL.part / 2) ** 2
"""Variance of the part of a touch that is left in the sheet once it has been lifted."""

_SPOT = [0, 1, 4, 5]
"""Of a state: the columns of a spot; 2 and 3 are its velocity, 6 and 7 direction and shape."""

_SIZE = 8


@dataclass(frozen=True, eq=False)
class MovingTouch:
    """The ``state`` (8,) of a touch at ``time`` s of the board, and its ``covariance`` (8, 8)."""

    time: float
    state: FloatArray
    covariance: FloatArray

    @classmethod
    def begin(
        cls, time: float, spot: FloatArray, covariance: FloatArray, prior: SpotPrior
    ) -> MovingTouch:
        """A touch at a ``spot`` (4,) whose position has a ``covariance`` (2, 2) m²: what else is
        known of it is the prior."""
        state, spread = np.zeros(_SIZE), np.zeros((_SIZE, _SIZE))
        state[_SPOT], spread[:2, :2] = spot, covariance
        state[4] = np.clip(state[4], *prior.log_radii)
        others = (_TRACK.speed, _TRACK.speed, prior.spread, spot[CONTENT], 1.0, 1.0)
        spread[range(2, _SIZE), range(2, _SIZE)] = np.square(others)
        return cls(time, state, spread)

    @classmethod
    def of_onset(cls, time: float, onset: Onset, prior: SpotPrior) -> MovingTouch:
        """A touch that has begun: nothing is known of its radius."""
        spot = np.array([*onset.middle, prior.middle[LOG_RADIUS], onset.spot[CONTENT]])
        return cls.begin(time, spot, onset.covariance, prior)

    @property
    def content(self) -> float:
        """The content of the touch, in m²."""
        return float(self.state[5])

    @property
    def spot(self) -> FloatArray:
        """(4,) the spot as the table of responses takes it."""
        return np.asarray(self.state[_SPOT])

    def at(self, time: float) -> MovingTouch:
        """The touch at a later ``time`` s."""
        seconds = max(time - self.time, 0.0)
        step, noise = _moving(round(seconds, 7))
        noise = noise.copy()
        noise[4, 4] = _SWELLS**2 * seconds
        noise[5, 5] = (_GROWS * self.state[5]) ** 2 * seconds
        return MovingTouch(time, step @ self.state, step @ self.covariance @ step.T + noise)

    def position(self) -> tuple[FloatArray, FloatArray]:
        """(2,) m and its covariance (2, 2) m², with what the sheet remembers of its way."""
        behind = _LAGS * self.state[2:4]
        memory = np.outer(behind, behind) + _FLOOR**2 * np.eye(2)
        return self.state[:2], self.covariance[:2, :2] + memory


Response = tuple[FloatArray, FloatArray, FloatArray]
"""(m,) V of a touch in the measurements of a drive, (m, 8) its slopes, and (m, m) V² by which it
may answer otherwise."""


def _root(covariance: FloatArray) -> FloatArray:
    """(m, m) lower root; LinAlgError where there is none."""
    root, fault = dpotrf(covariance, lower=1)
    if fault:
        raise np.linalg.LinAlgError("the covariance of a drive is not positive definite")
    return np.asarray(root)


def _cost(data: FloatArray, root: FloatArray) -> float:
    """Less the logarithm of the likelihood of normal ``data`` (m,) with the ``root`` (m, m) of
    their covariance, up to what all have."""
    white = dtrtrs(root, data, lower=1)[0]
    return float(white @ white) / 2 + float(np.log(root.diagonal()).sum())


@lru_cache(maxsize=16)
def _moving(seconds: float) -> tuple[FloatArray, FloatArray]:
    """(8, 8) by which a state goes on, and the noise of position and velocity meanwhile: those of
    the tracker."""
    leads, remains, there, cross, moving = motion_step(seconds, _TRACK)
    step, noise = np.eye(_SIZE), np.zeros((_SIZE, _SIZE))
    for place, speed in ((0, 2), (1, 3)):
        step[place, speed], step[speed, speed] = leads, remains
        noise[place, place], noise[speed, speed] = there, moving
        noise[place, speed] = noise[speed, place] = cross
    return step, noise


@dataclass(frozen=True, eq=False)
class DriveFilter:
    """What takes the measurements of a drive.

    Attributes
    ----------
    solver
        Its table says what a spot does.
    prior, sign
        Of the touches.
    sheet
        Where they may be.
    noise
        (n_meas, n_meas) V² of the measurements.
    """

    solver: Solver
    prior: SpotPrior
    sign: str
    sheet: SheetDomain
    noise: FloatArray

    def pushed(
        self,
        touch: MovingTouch,
        rows: slice,
        data: FloatArray,
        known: Response | None = None,
        others: FloatArray | float = 0.0,
    ) -> tuple[MovingTouch, float, float]:
        """The touch after the ``data`` (m,) V of a drive at its time, where its response may be
        ``known``, and the doubt of ``others`` (m, m) V²; and the logarithms of how much likelier
        these are if it has been lifted before the drive, and if while it was read."""
        before, spread = touch.state, touch.covariance
        own, state = self.noise[rows, rows] + others, before
        gone = going = 0.0
        for step in range(_STEPS):
            if step or known is None:
                known = self.response(state, spread, rows)
            change, slopes, doubt = known
            across, both = slopes @ spread, own + doubt
            off, root = data - change - slopes @ (before - state), _root(both)
            if not step:
                stands, half = _cost(off, root), change / 2  # a measurement shows it, or none of it
                gone = stands - _cost(data, _root(own + _LEFT * np.outer(change, change)))
                going = stands - _cost(data - half, _root(own + np.diag(half**2)))
            gain = dpotrs(root, across, lower=1)[0].T
            state = self._held(before + gain @ off)
        left = spread - gain @ both @ gain.T
        return MovingTouch(touch.time, state, (left + left.T) / 2), gone, going

    def response(self, state: FloatArray, spread: FloatArray, rows: slice) -> Response:
        """The response of a touch in a ``state`` (8,) with the covariance ``spread`` (8, 8)."""
        basis = self.solver.table.basis[:, rows]
        parts = self.solver.expanded(state[None, _SPOT])[0] @ basis
        change, own, unknown = parts[0], parts[1 : 1 + N_PARAMETERS], parts[1 + N_PARAMETERS :]
        unknown = unknown * np.array([[self.prior.directed], [self.prior.reshaped]])
        slopes = np.zeros((len(change), _SIZE))
        slopes[:, _SPOT] = own[[X, Y, LOG_RADIUS, CONTENT]].T
        slopes[:, 6:] = unknown.T
        change = change + state[6:] @ unknown
        return change, slopes, slopes @ spread @ slopes.T + np.diag((_OTHERWISE * change) ** 2)

    def _held(self, state: FloatArray) -> FloatArray:
        held = state.copy()
        held[_SPOT] = self.prior.held(self.sheet.held(state[None, _SPOT]), self.sign)[0]
        return held
