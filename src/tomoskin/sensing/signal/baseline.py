"""The reference: what an untouched skin reads, and how much it wavers; and the baseline, which
begins there, follows the untouched skin, and holds under a touch."""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass
from functools import cached_property
from typing import Self

import numpy as np

from tomoskin.core import DataError, FloatArray
from tomoskin.sensing.signal.health import Mask
from tomoskin.sensing.signal.idle import CommonMode, Idle

MEMORY = 512
"""Frames that a scatter rests on at most: older ones fade."""

_WILD = 6.0
"""A value counts for at most so many deviations."""


@dataclass(frozen=True, slots=True, eq=False)
class Scatter:
    """Mean product of the deviations of an idle frame from its reference, whose own error is in it.

    Attributes
    ----------
    matrix
        (n_meas, n_meas) V².
    frames
        How many independent frames it rests on.
    """

    matrix: FloatArray
    frames: int

    @classmethod
    def of(cls, values: FloatArray) -> Self:
        """About the mean of idle frames (n, n_meas) V, two at least."""
        away = values - values.mean(axis=0)
        n = len(values) - 1
        return cls(away.T @ away * ((n + 2) / (n + 1) / n), n)

    def after(self, deviations: FloatArray, lost: Mask) -> Scatter:
        """With further idle frames, (n, n_meas) V of deviation from what was expected of them.

        ``lost`` rows, (n_meas,) bool, say nothing: they stay as they were.

        What is wild beside those known is cut off: a knock at a cable is not the noise of all
        times. Noise that lasts is learnt in a few steps all the same.
        """
        most = _WILD * np.sqrt(np.diag(self.matrix))
        held = np.clip(deviations, -most, most)
        total = self.frames + len(held)
        matrix = (self.frames * self.matrix + held.T @ held) / total
        if lost.any():
            matrix = np.where(lost[:, None] | lost, self.matrix, matrix)
        return Scatter(matrix, min(total, MEMORY))


_QUIET = 0.5
"""A channel is never taken for quieter than this fraction of the median channel: a standard
deviation from a few frames can come out near zero by chance."""


@dataclass(frozen=True, eq=False)
class Reference:
    """Mean and noise of idle frames.

    ``mean`` (n_meas,) V; ``noise`` (n_meas,) standard deviation of one frame, V, NaN when there
    was a single frame; ``n_frames`` how many were averaged; ``least`` V, or (n_meas,) V, below
    which noise is never taken to be: what rounding leaves though nothing flickers.
    """

    mean: FloatArray
    noise: FloatArray
    n_frames: int
    least: FloatArray | float = 0.0
    scatter: Scatter | None = None

    @classmethod
    def of(cls, values: FloatArray, least: FloatArray | float = 0.0) -> Self:
        """Reference from idle frames, (n_frames, n_meas) V.

        Raises
        ------
        DataError
            When there is no frame, or a value is not finite.
        """
        if values.ndim != 2 or not len(values):
            raise DataError(f"expected frames (n, n_meas) for a reference, got {values.shape}")
        finite = np.isfinite(values)
        if not finite.all():
            frame, row = np.argwhere(~finite)[0].tolist()
            raise DataError(
                f"expected finite voltages, got {values[frame, row]}",
                where=f"reference frame {frame}, row {row}",
            )
        noise = np.maximum(_noise(values), least)
        scatter = Scatter.of(values) if len(values) > 1 else None
        return cls(values.mean(axis=0), noise, len(values), least, scatter)

    @property
    def noise_is_known(self) -> bool:
        """Whether there were frames enough to tell the noise."""
        return self.n_frames > 1


def _noise(values: FloatArray) -> FloatArray:
    if len(values) < 2:
        return np.full(values.shape[1], np.nan)
    spread = values.std(axis=0, ddof=1)
    return np.asarray(np.maximum(spread, _QUIET * np.median(spread)))


SLOWEST = 60.0
"""Time constant with which the baseline follows where no drift has been seen, s."""

_LINGER = 0.5
"""Seconds after a touch for which the baseline still holds."""

_FADING = 10.0
"""Seconds after a release in which the residual response fades into the baseline."""

_FADE = 1.0
"""Time constant of that, s."""

_CUT = 4.0
"""An innovation counts for at most so many of its deviations (Huber 1964)."""

_DOUBT = 3.0
"""Deviations of a frame's noise that a held baseline may have drifted before it is called stale."""

_DELAY = 3
"""Frames after which a frame is learnt: a touch is noticed only when it has stood for some."""

_LONGEST_STEP = 60.0
_ROUNDING = 1e-9

_TREND = 30.0
"""Seconds that the skin must have been followed before a trend is estimated."""


@dataclass(frozen=True, eq=False)
class BaselineState:
    """How the baseline is; what nobody asks for is not computed.

    Attributes
    ----------
    start, mean
        (n_meas,) V, the untouched skin when the reference was taken, and now.
    deviation
        (n_meas,) V, of one frame.
    variance
        (n_meas,) V² of the mean.
    n_frames
        Of that reference.
    held, followed
        Seconds for which it has been held under a touch, 0 where it follows; and for which it has
        followed.
    """

    start: FloatArray
    mean: FloatArray
    deviation: FloatArray
    variance: FloatArray
    n_frames: int
    held: float
    followed: float

    @cached_property
    def drift(self) -> float:
        """By how much it has moved since the reference, as a part of its size (rms of all rows)."""
        size = _rms(self.start)
        return _rms(self.mean - self.start) / size if size else 0.0

    @cached_property
    def noise(self) -> float:
        """The noise of one frame, V, rms of the rows."""
        return _rms(self.deviation)

    @cached_property
    def doubt(self) -> float:
        """What a held baseline may be off by, in deviations of one frame's noise; median row.

        As a random walk, and as much as the skin has gone one way until now, which a random walk
        does not foresee.
        """
        if not self.held:
            return 0.0
        walked = np.sort(self.variance / self.deviation**2)
        # each frame of a touch asks: numpy's own median takes ten times as long
        middle = float(walked[(len(walked) - 1) // 2] + walked[len(walked) // 2]) / 2
        if self.followed < _TREND:
            return math.sqrt(middle)
        moved = np.mean(((self.mean - self.start) / self.deviation) ** 2) - 1.0 / self.n_frames
        trend = math.sqrt(max(float(moved - walked.mean()), 0.0)) * self.held / self.followed
        return math.hypot(math.sqrt(middle), trend)

    @property
    def stale(self) -> str | None:
        """What someone should see to, or None."""
        if self.doubt < _DOUBT:
            return None
        return (
            f"a touch has held the reference for {self.held:.0f} s, and it may have drifted by "
            f"{self.doubt:.0f} times the noise: lift the touch, or take a new reference"
        )


class Baseline:
    """Scalar Kalman filters of a random walk, one a row (Kalman 1960), fed while nothing touches.

    All voltages in proportion are followed by a filter of their own (:class:`CommonMode`), and what
    each row does beside that by the row's: a jump of the gain is no matter of single rows.

    While a touch stands nothing is learnt, and the variance grows by what the skin drifts as a
    rule, so that afterwards the baseline comes back the faster the longer it was held.

    Parameters
    ----------
    reference
        Where it begins.
    follows
        False: it stays there; noise is estimated all the same.

    Attributes
    ----------
    start
        (n_meas,) V, mean of that reference.
    mean
        (n_meas,) V, what the untouched skin reads now.
    """

    def __init__(self, reference: Reference, *, follows: bool = True) -> None:
        self.start = reference.mean
        # frames that are all the same have no noise but for rounding
        least = _ROUNDING * _rms(reference.mean)
        self._known = reference.noise_is_known and bool((reference.noise > least).all())
        noise = reference.noise if self._known else np.full_like(reference.mean, np.nan)
        self._follows = follows and self._known
        self.mean = reference.mean
        self._n_frames = reference.n_frames
        self.idle = Idle(noise, reference.n_frames, SLOWEST, reference.least)
        self._least = reference.least
        self._common = (
            CommonMode(reference.mean, noise, reference.n_frames) if self._known else None
        )
        self._variance = noise**2 / reference.n_frames
        self._time: float | None = None
        self._held = 0.0
        self._linger = 0.0
        self._fading = 0.0
        self._followed = 0.0
        self._waiting: deque[tuple[FloatArray, Mask, float, float, bool]] = deque()
        self._scatter = reference.scatter
        self._deviations: list[FloatArray] = []

    def push(
        self, values: FloatArray, lost: Mask, time: float, *, touched: bool, noise: bool = True
    ) -> bool:
        """Take a frame, (n_meas,) V at ``time`` s; True where it ended a block of idle frames.

        ``lost`` rows, (n_meas,) bool, say nothing; ``touched``: whether something touches;
        ``noise``: whether what it shows beside the reference may be learnt as noise.
        """
        step = 0.0 if self._time is None else min(max(time - self._time, 0.0), _LONGEST_STEP)
        self._time = time
        if not self._known:
            return False
        self._variance = self._variance + self.idle.drift * step
        if touched:
            self._held += step
            self._linger, self._fading = _LINGER, _FADING
            return self._interrupted(step)
        if self._linger > 0:
            self._linger -= step
            return self._interrupted(step)
        self._held = 0.0
        self._followed += step
        self._waiting.append((values, lost, time, step, noise))
        if len(self._waiting) <= _DELAY:
            return False
        return self._learn(*self._waiting.popleft())

    def _learn(self, values: FloatArray, lost: Mask, time: float, step: float, noise: bool) -> bool:
        deviation = values - self.mean
        if self._follows:
            self._follow(values, lost, time, step)
        if self._fading > 0:
            self._fading -= step
            self.idle.interrupt()
            return False
        ended = self.idle.push(values, time, lost)
        if noise:
            self._deviations.append(deviation)
        if ended and self._scatter is not None and self._deviations:
            self._scatter = self._scatter.after(np.array(self._deviations), lost)
            self._deviations.clear()
        return ended

    def _follow(self, values: FloatArray, lost: Mask, time: float, step: float) -> None:
        noise = self.idle.noise**2
        assert self._common is not None
        apart = values - self.mean
        part = self._common.of(apart, self.idle.noise, lost)
        apart -= part * self.mean
        moved = self.mean * self._common.push(part, time, step)
        if self._fading > 0:
            gain = 1.0 - np.exp(-step / _FADE)
            self._variance = np.maximum(self._variance, noise * gain / (1.0 - gain + 1e-12))
        gain = self._variance / (self._variance + noise)
        gain[lost] = 0.0
        most = _CUT * np.sqrt(self._variance + noise)
        self.mean = self.mean + moved + gain * np.minimum(np.maximum(apart, -most), most)
        self._variance = (1.0 - gain) * self._variance

    @property
    def common_deviation(self) -> float:
        """By what part all voltages together may have moved since they were followed."""
        return self._common.deviation if self._common is not None and self._follows else 0.0

    def _interrupted(self, step: float) -> bool:
        self._waiting.clear()
        self._deviations.clear()
        self.idle.interrupt()
        if self._common is not None:
            self._common.interrupt(step)
        return False

    @property
    def reference(self) -> Reference:
        """The reference as it is now: the noise is a frame's together with the baseline's own."""
        if not self._known:
            return Reference(self.mean, self.idle.noise, self._n_frames, self._least)
        noise, frames = np.sqrt(self.idle.noise**2 + self._variance), max(self._n_frames, 2)
        return Reference(self.mean, noise, frames, self._least, self._scatter)

    @property
    def state(self) -> BaselineState:
        """The state of the baseline by now."""
        return BaselineState(
            self.start,
            self.mean,
            self.idle.noise,
            self._variance,
            self._n_frames,
            self._held,
            self._followed,
        )


def _rms(values: FloatArray) -> float:
    return float(np.sqrt(np.mean(values**2)))
