"""Presses in a stream of voltages: when one begins, stands still, and has ended."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass
from typing import Literal, Self

import numpy as np

from tomoskin.core import FloatArray
from tomoskin.pipeline import Prepared

Phase = Literal["rest", "press", "hold", "release"]
"""Hands off; press now; hold still; let go."""

_REST, _MOST_REST = 10, 32
"""Frames that the untouched skin is told from, at least and at most."""

_LAG = 4
"""Frames before those that show a press, which are not taken for untouched: it began in them."""

_WINDOWS = {1: 2.4, 4: 1.8, 16: 1.7}
"""Numbers of newest frames whose mean is looked at, the more the fainter a press may be; and noises
of its own by which the mean must differ from the untouched skin to be a press."""

_STEADY, _LONGEST, _STEP = 8, 40, 4
"""Frames that a press must stand still for, at least and at most; lengths that are tried."""

_CLEAR, _FAINTEST = 6.0, 2.0
"""Noises by which the mean of a press must differ from the untouched skin until no more frames are
awaited; and below which it is none to learn from, after the most frames."""

_STILL, _WAVERS = 0.06, 1.3
"""How far a half or a quarter of a steady press may be from the rest: a part of itself, and noises
of the difference. The two add up."""

_RELEASED = 0.4
"""A press is over when this part of it is left."""

_PATIENCE = 5.0
"""Seconds in a phase after which it is said what is wrong."""

_EARLY = "The last press ended too early: hold still until it is recorded."
_UNSEEN = "The last press was too faint to be seen: press a little harder."
_TOUCHED = (
    "Something touches the skin already. Let go, and wait until you are asked to press; if nothing "
    "touches it, take the reference again."
)

_BELIEVED = 8.0
"""Seconds for which a touch that shows keeps a frame from passing for the untouched skin: one that
stays may be none."""

_LIFTING = 1.0
"""Seconds for which a touch may still show after a press has been let go."""

OFTEN = 0.02
"""Frames are taken no more often than this, s: a hand is not faster."""

_LEAST = 0.5
"""Noise is never taken for less than this part of what the read-out predicts."""


_SIGNS = {"decrease": 1, "increase": -1}
"""Of the voltages' magnitudes, by what a press does to the conductivity."""


@dataclass(frozen=True, eq=False)
class _Untouched:
    """The untouched skin: ``mean`` and ``noise`` (n_meas,) V of a frame, as told from ``count``
    frames."""

    mean: FloatArray
    noise: FloatArray
    count: int

    @classmethod
    def of(cls, frames: FloatArray, least: float) -> Self:
        """Of frames (n, n_meas) V, with no less noise than ``least`` V."""
        own = frames.var(axis=0, ddof=1)  # of few frames: drawn halfway to that of all rows
        noise = np.maximum(np.sqrt((own + np.nanmean(own)) / 2), least)
        return cls(frames.mean(axis=0), noise, len(frames))

    def size(self, frames: FloatArray) -> float:
        """How far the mean of frames is from the untouched skin, in noises of one frame; what
        noise alone would show is taken off."""
        apart = self.noises(frames.mean(axis=0) - self.mean)
        return float(np.sqrt(max(apart**2 - self.deviation(len(frames)) ** 2, 0.0)))

    def deviation(self, n: int) -> float:
        """Of the mean of ``n`` frames less the untouched skin, in noises of one frame."""
        return float(np.sqrt(1 / n + 1 / self.count))

    def noises(self, change: FloatArray) -> float:
        """Root mean square in noises, of the rows that are known."""
        squares = (change / self.noise) ** 2
        known = squares[np.isfinite(squares)]
        return float(np.sqrt(known.mean())) if len(known) else 0.0

    def stands_still(self, frames: FloatArray) -> bool:
        """Whether neither half, nor any quarter, is unlike the other frames."""
        most = _STILL * self.size(frames)
        for parts in (2, 4):
            means = frames.reshape(parts, -1, frames.shape[1]).mean(axis=1)
            others = (means.sum(axis=0) - means) / (parts - 1)
            noise = np.sqrt(parts / len(frames) * (1 + 1 / (parts - 1)))
            moved = max(self.noises(apart) for apart in means - others)
            if moved > most + _WAVERS * noise:
                return False
        return True


_UNKNOWN = _Untouched(np.zeros(0), np.zeros(0), 1)


class PressTaker:
    """Takes presses from a stream of voltages.

    The untouched skin is what was read just before each press, so that drift and what a press
    leaves behind do not matter. A faint press is averaged for longer than a clear one.

    Parameters
    ----------
    least
        V that noise is never taken to be below.
    sign
        1 where a press makes voltages larger by magnitude, -1 where smaller, 0 where either.
    """

    def __init__(self, least: float, sign: int = 0) -> None:
        self._least, self._sign = least, sign
        self._last = self._now = self._since = -np.inf
        self._rest, self._window = _UNKNOWN, 1
        self._frames: deque[FloatArray] = deque(maxlen=_MOST_REST + _LAG + max(_WINDOWS))
        self._pressed: deque[FloatArray] = deque(maxlen=_LONGEST)
        self._largest = self._clear = 0.0
        self._remark = ""
        self._touched = False
        self._enter("rest")

    def restart(self) -> None:
        """The skin is read anew: nothing touches it now."""
        self._frames.clear()
        self._enter("rest")

    @classmethod
    def of(cls, prepared: Prepared) -> Self:
        """For the skin that is prepared."""
        return cls(_LEAST * prepared.readout.noise, _SIGNS.get(prepared.skin.touch.sign, 0))

    @property
    def untouched(self) -> tuple[FloatArray, FloatArray] | None:
        """(n_meas,) V, mean and noise before the last press; None before the first frames."""
        return None if self._rest is _UNKNOWN else (self._rest.mean, self._rest.noise)

    @property
    def hint(self) -> str:
        """What is wrong and what to do; "" where nothing is."""
        late = self._now - self._since > _PATIENCE
        if self.phase == "release" and late:
            return (
                "The skin is not as it was before this press. Let go; if nothing touches it, undo "
                "this press."
            )
        if self._touched and (late or self._now - self._since > _LIFTING):
            return _TOUCHED
        if self.phase == "press" and late:
            return (
                "No press shows in the voltages. If you are pressing, let go, then press a little "
                "harder."
            )
        if self.phase in {"rest", "press"}:
            return self._remark
        if self.phase == "hold" and late:
            return self._held_up()
        return ""

    def _held_up(self) -> str:
        if not self._clear:
            return "The voltages still change: press with the same force, at the same position."
        if len(self._pressed) < _LONGEST or self._clear >= _FAINTEST:
            return "A faint press: hold still, more frames are averaged."
        return (
            f"This press is too faint: expected {_FAINTEST:g} noises in the mean of {_LONGEST} "
            f"frames, found {self._clear:.1f}. Press a little harder."
        )

    def push(
        self, host_time: float, voltages: FloatArray, *, touched: bool = False
    ) -> FloatArray | None:
        """Take a frame (n_meas,) V; (n_meas,) V, the change, when a press has stood still.

        ``touched``: the run shows a touch in it.
        """
        if 0 <= host_time - self._last < OFTEN:
            return None
        self._last = self._now = host_time
        if np.isinf(self._since):
            self._since = host_time
        if self.phase == "rest":
            self._touched = touched
            if touched and self._now - self._since < _BELIEVED:
                self._frames.clear()
                return None
        if self.phase in {"rest", "press"}:
            self._wait(voltages)
            return None
        self._pressed.append(voltages)
        size = self._rest.size(np.array(self._pressed)[-self._window :])
        if size < _RELEASED * self._largest:
            self._remark = _EARLY if self.phase == "hold" else ""
            self.restart()
            return None
        if self.phase == "release":
            return None
        self._largest = max(self._largest, size)
        return self._steady()

    def _enter(self, phase: Phase) -> None:
        self.phase: Phase = phase
        self._since = self._now

    def _wait(self, frame: FloatArray) -> None:
        """For a press, the untouched skin in view."""
        self._frames.append(frame)
        if self.phase == "rest" and len(self._frames) >= _REST + _LAG:
            self._enter("press")
        frames = np.array(self._frames)
        for window, present in _WINDOWS.items():
            quiet = frames[: -window - _LAG][-_MOST_REST:]
            if len(quiet) < _REST:
                return
            self._rest = rest = _Untouched.of(quiet, self._least)
            apart = frames[-window:].mean(axis=0) - rest.mean
            if rest.noises(apart) > present * rest.deviation(window):
                if self._sign * float(np.nansum(np.sign(rest.mean) * apart)) < 0:
                    # it has ended, and had passed for the untouched skin
                    self._remark = "" if self._touched else _UNSEEN
                    self.restart()
                else:
                    self._press(frames[-window:], window)
                return

    def _press(self, newest: FloatArray, window: int) -> None:
        self._enter("hold")
        self._window, self._remark, self._touched = window, "", False
        self._largest, self._clear = self._rest.size(newest), 0.0
        self._pressed.clear()
        self._pressed.extend(newest[-max(1, window // 4) :])

    def _steady(self) -> FloatArray | None:
        """The change, once the newest frames stand still and are enough of them."""
        frames = np.array(self._pressed)
        self._clear = 0.0
        for n in range(_STEADY, len(frames) + 1, _STEP):
            if not self._rest.stands_still(frames[-n:]):
                continue
            self._clear = float(np.sqrt(n)) * self._rest.size(frames[-n:])
            if self._clear >= (_CLEAR if n < _LONGEST else _FAINTEST):
                self._enter("release")
                self._pressed.clear()
                return np.asarray(frames[-n:].mean(axis=0) - self._rest.mean)
        return None
