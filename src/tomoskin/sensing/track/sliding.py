"""Touches that slide: where the finger is.

Friction drags the sheet along with a finger that slides: it is stretched behind the finger and
compressed ahead of it, so that the middle of its response lies behind the finger. How far depends
hardly on the speed, and nothing is left of it once the finger stands. So the response jumps when a
finger begins to slide, turns or stops: that tells what it does, and how far the sheet lags.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Self

import numpy as np

from tomoskin.core import ComplexArray, FloatArray, Touch

_WAYS: ComplexArray = np.append(np.exp(0.125j * np.pi * np.arange(16)), 0.0)
_AXES = np.stack([_WAYS.real, _WAYS.imag])
"""What a finger may do: directions in which it slides, as x + iy and as (2, k); the last stands."""

# Chosen on the twin's seeds 1 to 3 (docs/theory/tracking.md).

_SPEED, _UNSTEADY = 0.06, 1e-4
"""Speed of a finger that slides, m/s; what a second adds to the variance of its position, m²."""

_GOES_ON, _CHANGED = 1.0, np.where(_WAYS, 0.05, 0.2)
"""Seconds for which a finger goes on as it does; how probable each is once it does not."""

_NOISE, _UNEVEN = 0.002, 0.25
"""Deviation of the response's position, m, and of the lag from one place to another, in parts."""

_UNLIKELY = 30.0
"""Squared length of an error beyond which it is another finger."""

_NEAR, _RECENT = 0.002, 0.15
"""A touch stands that has stayed within so many m for so many seconds."""

_STEP, _PAUSE = 0.04, 0.35
"""Seconds within which frames tell the same, and after which nothing is known of a finger."""

_LAGS, _COURSE, _TOLD = 2e-3 * np.arange(16), 600, 10.0
"""Lags that are tried, m; frames in a row that tell which is likeliest; by how much it must be
likelier than none (logarithm)."""


@dataclass(frozen=True, slots=True, eq=False)
class SlidingFinger:
    """What a finger may be doing, and where it is if it does; positions are x + iy, m.

    Interacting models (Blom & Bar-Shalom 1988), one for each direction and one that stands.

    Attributes
    ----------
    lag
        Of the sheet behind the finger, m.
    time
        Of the newest frame, s.
    moved
        When and where the response has last moved.
    places, odds, variances
        (k,) where the finger is if it does each of what it may, how probable that is, and the
        variance of the place along each axis, m².
    evidence
        Logarithm of the likelihood of the frames so far.
    """

    lag: float
    time: float
    moved: tuple[float, complex]
    places: ComplexArray
    odds: FloatArray
    variances: FloatArray
    evidence: float = 0.0

    @classmethod
    def landed(cls, lag: float, time: float, seen: complex) -> Self:
        """A finger that stands, and whose response is ``seen``."""
        known = np.full(len(_WAYS), _NOISE**2)
        return cls(lag, time, (time, seen), seen + lag * _WAYS, 1.0 * (_WAYS == 0), known)

    def after(self, time: float, seen: complex) -> Self:
        """The same after a frame in which the response is ``seen``."""
        seconds = time - self.time
        if 0 < seconds < _STEP:
            return self
        anew = replace(self.landed(self.lag, time, seen), evidence=self.evidence - _UNLIKELY)
        if not 0 < seconds < _PAUSE:
            return anew
        moved = anew.moved if abs(seen - self.moved[1]) > _NEAR else self.moved
        grown = self.variances + seconds * _UNSTEADY * abs(_WAYS)
        total = grown + _NOISE**2
        goes = seconds * _SPEED * _WAYS
        off = abs(anew.places - goes - self.places[:, None]) ** 2 / total
        if off.min() > _UNLIKELY or time - moved[0] > _RECENT:
            return replace(anew, moved=moved)
        stays = math.exp(-seconds / _GOES_ON)
        changes = (1 - stays) * _CHANGED + stays * np.eye(len(_WAYS))
        joint = self.odds[:, None] * changes * np.exp(-0.5 * np.minimum(off, _UNLIKELY)) / total
        odds, gain = joint.sum(axis=0), grown / total
        places = (1 - gain) * (joint.T @ self.places / odds + goes) + gain * anew.places
        likely, known = odds.sum(), gain * _NOISE**2
        evidence = self.evidence + math.log(likely)
        return type(self)(self.lag, time, moved, places, odds / likely, known, evidence)


def likeliest_lag(times: Sequence[float] | FloatArray, seen: FloatArray) -> float:
    """m by which the sheet lags behind a finger that slides; 0 where its course does not tell.

    ``times`` (n,) s, and where the response was ``seen`` (n, 2) m.
    """
    first = max(len(times) - _COURSE, 0) // 2
    course = [(t, complex(x, y)) for t, (x, y) in zip(times, seen, strict=True)]
    likely = []
    for lag in _LAGS:
        finger = SlidingFinger.landed(lag, *course[first])
        for time, place in course[first + 1 : first + _COURSE]:
            finger = finger.after(time, place)
        likely.append(finger.evidence)
    best = int(np.argmax(likely[:-1]))
    clear = likely[best] > max(likely[0] + _TOLD, likely[-1])
    halfway = _SPEED * float(np.median(np.diff(times))) / 2  # to where it turns between two frames
    return max(float(_LAGS[best]) - halfway, 0.0) if clear else 0.0


@dataclass(frozen=True, slots=True, eq=False)
class SlideCorrection:
    """Moves touches ahead by what the sheet lags behind them, from frame to frame.

    Attributes
    ----------
    lag
        Of the sheet behind a finger that slides, m; 0: no touch is moved.
    fingers
        Of the touches that are there, by identity.
    """

    lag: float
    fingers: Mapping[int, SlidingFinger] = field(default_factory=dict)

    def after(self, touches: Sequence[Touch], time: float) -> Self:
        """With a frame at ``time`` s of the device, in which ``touches`` were."""
        fingers = {touch.id: self._gone_on(touch, time) for touch in touches if self.lag}
        return type(self)(self.lag, fingers)

    def of_finger(self, touch: Touch) -> Touch:
        """``touch`` of the newest frame where the finger is; itself where it stands."""
        finger, d, lag = self.fingers.get(touch.id), touch.detection, self.lag
        if finger is None or finger.odds[-1] >= 0.5:
            return touch
        mean = lag * _AXES @ finger.odds
        square = (1 + _UNEVEN**2) * lag**2 * (finger.odds * _AXES) @ _AXES.T
        (x, y), ((xx, xy), (_, yy)) = mean.tolist(), (square - np.outer(mean, mean)).tolist()
        sd_x, sd_y = math.sqrt(d.sd_x**2 + xx), math.sqrt(d.sd_y**2 + yy)
        moved = replace(d, x=d.x + x, y=d.y + y, sd_x=sd_x, sd_y=sd_y, cov_xy=d.cov_xy + xy)
        return replace(touch, detection=moved)

    def _gone_on(self, touch: Touch, time: float) -> SlidingFinger:
        before, seen = self.fingers.get(touch.id), complex(touch.detection.x, touch.detection.y)
        return before.after(time, seen) if before else SlidingFinger.landed(self.lag, time, seen)
