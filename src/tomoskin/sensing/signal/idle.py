"""What an untouched skin shows while time goes by: its noise, its drift, and its common mode."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from tomoskin.core import FloatArray
from tomoskin.sensing.signal.health import Mask

BLOCK = 32
"""Idle frames in a row that are looked at together."""

_CUT = 16.0
"""Squared steps are cut off at so many times their mean: rare wild values are not noise."""

_MEMORY = 512
"""Frames that a noise estimate rests on at most."""

_QUIET = 0.5
"""A row is never taken for quieter than this part of the median row."""

_LEVELS = 64
"""Levels that are kept of the way that the skin has drifted."""

_FEWEST = 8
"""Levels before a direction of drift is looked for."""

_EDGE = 1.25
"""A direction is drift when its singular value is so many times the largest that noise has."""

_TOUCHLIKE = 0.7
"""Cosine to the change that one cell causes, above which a direction may be a touch's."""

MODES = 2
"""Most directions that are learnt."""


class Idle:
    """Collects idle frames in blocks; feed it frames that nothing touches.

    Attributes
    ----------
    noise
        (n_meas,) V, standard deviation of one frame, from differences of successive frames, which
        drift leaves alone (von Neumann 1941, Ann. Math. Statist. 12, 367).
    drift
        (n_meas,) V²/s: variance that the skin at rest gains per second, as a random walk.
    blocks
        Full blocks until now.
    """

    def __init__(
        self, noise: FloatArray, n_frames: int, slowest: float, least: FloatArray | float = 0.0
    ) -> None:
        """``noise`` V of ``n_frames`` frames, which is ``least`` V at the least; ``slowest`` s:
        the least drift is the one that is followed with this time constant."""
        self.noise, self._least = noise, np.square(least)
        self._weight = float(max(n_frames - 1, 1))
        self._slowest = slowest
        self._steps: FloatArray | None = None  # excess of steps between blocks, V² per step
        self._span = 0.0
        self.interval = 0.0
        self.blocks = 0
        self._levels: list[tuple[int, FloatArray]] = []
        self._stretch, self._stride, self._since = 0, 1, 0
        self.drift = self._drift()
        self._start_block()

    def interrupt(self) -> None:
        """Something touched: the next block does not follow upon the last."""
        if self._count or self._last_mean is not None:
            self._stretch += 1
            self._start_block()

    def _start_block(self) -> None:
        self._count = 0
        self._sum = np.zeros_like(self.noise)
        self._squares = np.zeros_like(self.noise)
        self._last: FloatArray | None = None
        self._last_mean: FloatArray | None = None
        self._lost: Mask | None = None
        self._begin = 0.0

    def _drift(self) -> FloatArray:
        least = self.noise**2 * max(self.interval, 1e-3) / self._slowest**2
        if self._steps is None or not self._span > 0:
            return np.asarray(least)
        # means of two blocks of a random walk are 2/3 of a block's time apart (its variance)
        return np.asarray(least + np.maximum(self._steps, 0.0) * 1.5 / self._span)

    def push(self, values: FloatArray, time: float, lost: Mask) -> bool:
        """Take an idle frame, (n_meas,) V at ``time`` s; True where it ended a block.

        ``lost`` rows, (n_meas,) bool, do not count; with other lost rows the block starts again.
        """
        if self._lost is not None and lost is not self._lost and (lost != self._lost).any():
            self.interrupt()
        self._lost = lost
        if self._last is not None:
            step = values - self._last
            step *= step
            np.minimum(step, 2.0 * _CUT * self.noise**2, out=step)
            self._squares += step
        else:
            self._begin = time
        self._last = values
        self._sum += values
        self._count += 1
        if self._count < BLOCK:
            return False
        self._end(time, lost)
        return True

    def _end(self, time: float, lost: Mask) -> None:
        mean = self._sum / BLOCK
        self._learn_noise(self._squares / (2.0 * (BLOCK - 1)), lost)
        self.interval = max(time - self._begin, 0.0) / (BLOCK - 1)
        if self._last_mean is not None:
            self._learn_drift(np.where(lost, 0.0, mean - self._last_mean))
        self.drift = self._drift()
        self._keep(mean)
        self.blocks += 1
        self._count = 0
        self._sum, self._squares = np.zeros_like(mean), np.zeros_like(mean)
        self._last, self._last_mean = None, mean

    def _learn_noise(self, variance: FloatArray, lost: Mask) -> None:
        total = self._weight + BLOCK
        learnt = (self._weight * self.noise**2 + BLOCK * variance) / total
        learnt = np.where(lost, self.noise**2, learnt)
        quietest = (_QUIET * np.median(np.sqrt(learnt))) ** 2
        self.noise = np.sqrt(np.maximum(learnt, np.maximum(quietest, self._least)))
        self._weight = min(total, float(_MEMORY))

    def _learn_drift(self, step: FloatArray) -> None:
        self._span = BLOCK * self.interval
        excess = step**2 - 2.0 * self.noise**2 / BLOCK
        common = self.noise**2 * float(np.mean(excess / self.noise**2))
        fresh = (excess + common) / 2.0  # a row's own is uncertain, the mean of all is not
        self._steps = fresh if self._steps is None else self._steps + (fresh - self._steps) / 8.0

    def _keep(self, level: FloatArray) -> None:
        """One of the levels, ever fewer of them as time goes by."""
        self._since += 1
        if self._since >= self._stride:
            self._since = 0
            self._levels.append((self._stretch, level))
            if len(self._levels) > _LEVELS:
                self._levels = self._levels[::2]
                self._stride *= 2

    def modes(self, signatures: Callable[[], FloatArray]) -> FloatArray:
        """(n_meas, k) V: directions in which the skin has drifted, beyond noise.

        Principal directions of the levels, each stretch between two touches about its own mean:
        what a touch leaves behind is no drift. They count above the edge of the spectrum of
        noise (Marchenko & Pastur 1967: √n + √m for n by m) and where no touch could have caused
        them: ``signatures`` gives (n_meas, n_cells) V, what each cell's change does to the data,
        and is asked where there are some.
        """
        levels = self._centred()
        if len(levels) < _FEWEST:
            return np.zeros((len(self.noise), 0))
        _, singular, directions = np.linalg.svd(levels, full_matrices=False)
        edge = (np.sqrt(len(self.noise)) + np.sqrt(len(levels))) / np.sqrt(BLOCK)
        beyond = directions[:MODES][singular[:MODES] > _EDGE * edge]
        if not len(beyond):
            return np.zeros((len(self.noise), 0))
        whitened = signatures() / self.noise[:, None]
        whitened /= np.maximum(np.linalg.norm(whitened, axis=0), 1e-300)
        cosine = np.abs(beyond @ whitened).max(axis=1)
        return np.asarray((beyond[cosine < _TOUCHLIKE] * self.noise).T)

    def _centred(self) -> FloatArray:
        """(m, n_meas) levels in deviations of a frame, each about the mean of its stretch."""
        if not self._levels:
            return np.zeros((0, len(self.noise)))
        stretch = np.array([number for number, _ in self._levels])
        levels = np.array([level for _, level in self._levels]) / self.noise
        own = stretch == np.unique(stretch)[:, None]
        mean = (own @ levels) / own.sum(axis=1)[:, None]
        centred = levels - own.T @ mean
        return np.asarray(centred[own.sum(axis=1) @ own > 1])


_JUMPS = 4.0
"""Deviations beyond which a frame's common mode has jumped, and is not followed at once."""

_STANDS = 8
"""Frames for which a jump must stand to be taken for the new level."""

_SLOWEST = 5.0
"""Time constant with which it is followed where no drift has been seen, s."""

_WALKS, _WORTH = 3e-4, 2
"""Part of itself by which the level walks in the root of a second under a touch, before touches
have told; and so many touches that this is worth."""

_NOBODY = np.zeros(1, bool)


class CommonMode:
    """A scalar Kalman filter of a random walk (Kalman 1960) that also takes jumps which stand.

    Parameters
    ----------
    mean
        (n_meas,) V of the untouched skin: its direction.
    noise
        (n_meas,) V, of one of ``frames`` frames.
    """

    def __init__(self, mean: FloatArray, noise: FloatArray, frames: int) -> None:
        deviation = 1 / float(np.linalg.norm(mean / noise))
        self._idle = Idle(np.array([deviation]), frames, _SLOWEST)
        self._level, self._variance = 1.0, deviation**2 / frames
        self._held, self._walks = 0.0, [_WORTH * _WALKS**2, float(_WORTH)]
        self._walk = self._walks[0] / self._walks[1]  # 1/s, variance of the level under a touch
        self._apart: list[float] = []
        self._mean = mean
        self._weights: tuple[FloatArray, Mask | None, FloatArray] = noise, None, mean

    def of(self, change: FloatArray, noise: FloatArray, lost: Mask) -> float:
        """Part of the mean that a ``change`` (n_meas,) V has, least squares in ``noise`` (n_meas,)
        V without the ``lost`` rows."""
        known, mask, weights = self._weights
        if known is not noise or mask is not lost:
            weights = np.where(lost, 0.0, self._mean / noise**2)
            weights = weights / max(float(weights @ self._mean), 1e-300)
            self._weights = noise, lost, weights
        return float(weights @ change) / self._level

    def push(self, part: float, time: float, step: float) -> float:
        """By what part the level has moved, after a further idle frame at ``time`` s, ``step`` s
        after the one before, that is apart from it by such a ``part``."""
        self._idle.push(np.array([self._level * (1 + part)]), time, _NOBODY)
        noise = float(self._idle.noise[0]) ** 2
        self._variance += float(self._idle.drift[0]) * step
        if self._held:
            self._walked(part**2 - self._variance - noise)
        total = self._variance + noise
        if part**2 > _JUMPS**2 * total:
            moved = self._jumped(part, noise)
        else:
            self._apart.clear()
            gain = self._variance / total
            self._variance *= 1 - gain
            moved = gain * part
        self._level *= 1 + moved
        return moved

    @property
    def deviation(self) -> float:
        """What the level may have walked by since it was followed, as a part of it."""
        return math.sqrt(self._variance + self._walk * self._held)

    def _walked(self, square: float) -> None:
        """Take by how much beyond the noise, squared, the level is elsewhere after a touch."""
        total, count = self._walks
        self._walks = [total + max(square, 0.0) / self._held, count + 1]
        self._walk = self._walks[0] / self._walks[1]
        self._variance += self._walk * self._held
        self._held = 0.0

    def interrupt(self, step: float) -> None:
        """Something touches, for a further ``step`` s."""
        self._held += step
        self._apart.clear()
        self._idle.interrupt()

    def _jumped(self, part: float, noise: float) -> float:
        """To where the last frames are, once they agree."""
        self._apart.append(part)
        if len(self._apart) < _STANDS:
            return 0.0
        middle = float(np.median(self._apart))
        if max(abs(value - middle) for value in self._apart) ** 2 > _JUMPS**2 * noise:
            del self._apart[0]
            return 0.0
        self._apart.clear()
        self._variance = noise / _STANDS
        return middle
