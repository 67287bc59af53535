"""Fixed-lag smoothing: an image a few frames late, that also knows those frames."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tomoskin.core import FloatArray, Image, ModelError
from tomoskin.inverse.modes import Modes
from tomoskin.inverse.one_step import OneStep
from tomoskin.inverse.temporal import Belief, advance, checked_time_constant, picture


@dataclass(frozen=True, eq=False)
class Smoothed:
    """An image of ``time`` s; ``variance`` (k,) of its modes, as a part of the prior's."""

    time: float
    image: Image
    variance: FloatArray


class Smoother:
    """The filter of :class:`Temporal`, followed by a pass back over the last ``lag`` frames.

    The pass is that of Rauch, Tung & Striebel (1965), mode by mode.

    Raises
    ------
    ModelError
        When the lag is not a whole number of frames from 0, or the time constant no time.
    """

    def __init__(self, operator: OneStep | Modes, time_constant: float, lag: int) -> None:
        if not (isinstance(lag, int) and lag >= 0):
            raise ModelError(f"expected a lag of 0 frames or more, got {lag}")
        self.modes = Modes.taken_from(operator)
        self.time_constant = checked_time_constant(time_constant)
        self.lag = lag
        self._beliefs: deque[Belief] = deque(maxlen=lag + 1)

    def push(self, dv: NDArray[Any], time: float) -> Smoothed | None:
        """Image of the frame ``lag`` frames ago; None until there were so many.

        Raises DataError as :meth:`Temporal.push`.
        """
        last = self._beliefs[-1] if self._beliefs else None
        self._beliefs.append(advance(self.modes, self.time_constant, last, dv, time))
        if len(self._beliefs) <= self.lag:
            return None
        *_, oldest = self._backwards()
        return self._shown(oldest)

    def finish(self) -> tuple[Smoothed, ...]:
        """Images of the frames that are still waiting, oldest first; then it starts anew."""
        waiting = list(self._backwards())[::-1]
        if len(self._beliefs) > self.lag:
            del waiting[0]
        self._beliefs.clear()
        return tuple(self._shown(belief) for belief in waiting)

    def _shown(self, belief: Belief) -> Smoothed:
        return Smoothed(belief.time, picture(self.modes, belief.mean), belief.variance)

    def _backwards(self) -> Iterator[Belief]:
        """Every frame in the window given all of them, newest first."""
        known: Belief | None = None
        later: Belief | None = None
        for belief in reversed(self._beliefs):
            known = belief if known is None or later is None else _given(belief, later, known)
            later = belief
            yield known


def _given(belief: Belief, later: Belief, known: Belief) -> Belief:
    """``belief``, when ``known`` is all that is known of the frame after it, ``later``."""
    share = np.divide(
        later.kept * belief.variance,
        later.expected,
        out=np.zeros_like(later.expected),
        where=later.expected > 0,
    )
    return replace(
        belief,
        mean=belief.mean + share * (known.mean - later.kept * belief.mean),
        variance=belief.variance + share**2 * (known.variance - later.expected),
    )
