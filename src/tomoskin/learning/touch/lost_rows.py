"""A locator for frames that lack rows for good: one that has learnt without them."""

from __future__ import annotations

from concurrent.futures import Future
from dataclasses import replace
from threading import Thread

import numpy as np

from tomoskin.core import DataError, FloatArray, IntArray
from tomoskin.learning.touch.locator import Locator

OFFLINE, LIVE = (3, 0), (8, 100)
"""Patience where frames wait for the answer, and where they do not."""

_MOST = 0.8
"""Part of the rows without which nothing is learnt."""


def without(locator: Locator, rows: IntArray) -> Locator:
    """Locator that has learnt from the same presses without some ``rows`` of the pattern.

    It locates frames that lack these rows, without values that are filled in. Raises DataError
    where no other row says anything.
    """
    dv = locator.presses.dv.copy()
    dv[:, rows] = np.nan
    presses = replace(locator.presses, dv=dv)
    return locator.learn(presses, locator.region, locator.pattern, locator.skin_id)


class LostRows:
    """Chooses what answers a frame: the locator, or what it is without the rows that are missing.

    Values that are filled in make a calibration worse and its ellipses too small, so it learns
    again once the same rows have been missing for some frames. That takes up to seconds, in a
    thread of its own. Its answers begin at a frame, not at a moment, so that a replay says the
    same.

    Parameters
    ----------
    locator
        With all rows.
    patience
        Frames that lack the same rows before it learns, and from then on until it must be ready.
    """

    def __init__(self, locator: Locator, patience: tuple[int, int]) -> None:
        self._locator, self._patience = locator, patience
        self._missing = b""
        self._count = 0
        self._learnt: Future[Locator] | None = None

    def __call__(self, frame: FloatArray) -> Locator:
        """What answers the next ``frame`` (n_meas,), NaN where a value is missing."""
        rows = self._locator.features.rows
        missing = ~np.isfinite(frame[rows])
        if not missing.any() or missing.mean() > _MOST:
            return self._locator
        key = missing.tobytes()
        if key != self._missing:
            if self._learnt is not None and not self._learnt.done():
                return self._locator  # one at a time
            self._missing, self._count, self._learnt = key, 0, None
        self._count += 1
        begin, wait = self._patience
        if self._count == begin:
            self._learnt = self._learn(rows[missing])
        if self._learnt is None or self._count < begin + wait:
            return self._locator
        return self._learnt.result()

    def _learn(self, rows: IntArray) -> Future[Locator]:
        future: Future[Locator] = Future()

        def learn() -> None:
            try:
                future.set_result(without(self._locator, rows))
            except DataError:  # nothing is left to learn from
                future.set_result(self._locator)
            except BaseException as error:
                future.set_exception(error)

        Thread(target=learn, daemon=True, name="learning without rows").start()
        return future
