"""What an untouched skin shows while time goes by: its noise, how fast it drifts, and which way."""

from __future__ import annotations

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
