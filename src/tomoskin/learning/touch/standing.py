"""A touch that stands still: the mean of its newest frames has less noise than one of them."""

from __future__ import annotations

from collections import deque

import numpy as np

from tomoskin.core import FloatArray

_FRAMES = 8
"""Frames in a mean: as many as a guided press is learnt from."""

_MOVED = 1.5
"""How many times what noise explains frames may differ by that are of one position."""

_NOISES = 30
"""Newest frames that tell the noise."""


class Standing:
    """The mean of the newest frames in which a touch stood still.

    The noise is told from second differences over time, in which an even motion does not show.
    """

    def __init__(self) -> None:
        self._frames: deque[FloatArray] = deque(maxlen=_FRAMES)
        self._newest: deque[FloatArray] = deque(maxlen=3)
        self._noises: deque[float] = deque(maxlen=_NOISES)

    def clear(self) -> None:
        """The touch has ended."""
        self._frames.clear()
        self._newest.clear()

    @property
    def stands(self) -> bool:
        """Whether the mean is one of as many frames as it can be."""
        return len(self._frames) == _FRAMES

    def push(self, dv: FloatArray) -> FloatArray:
        """(n_meas,) mean of the newest frame ``dv`` (n_meas,), NaN where a value is missing, and
        of those before it that differ from it by noise alone."""
        frames = self._frames
        if frames and (np.isfinite(frames[-1]) != np.isfinite(dv)).any():
            self.clear()
        frames.append(dv)
        self._newest.append(dv)
        if len(self._newest) == self._newest.maxlen:
            first, second, third = self._newest
            self._noises.append(float(np.nanmean((first - 2 * second + third) ** 2)) / 6)
        while len(frames) > 1 and self._moves():
            frames.popleft()
        return np.asarray(np.mean(frames, axis=0))

    def _moves(self) -> bool:
        """Whether the newest frame, or the newer half, is unlike those before."""
        if not self._noises:
            return True
        frames, noise = np.array(self._frames), float(np.median(self._noises))
        n = len(frames)
        for newer in {1, n // 2}:
            step = frames[-newer:].mean(axis=0) - frames[:-newer].mean(axis=0)
            expected = noise * (1 / newer + 1 / (n - newer))
            if float(np.nanmean(step**2)) > _MOVED**2 * expected:
                return True
        return False
