"""The pre-roll of a recording: what it begins with, so that a replay of it is as the run was."""

from __future__ import annotations

from collections import deque

from tomoskin.core import Frame
from tomoskin.pipeline import REFERENCE_FRAMES, FrameResult
from tomoskin.recording import Mark

_KEPT = 3 * REFERENCE_FRAMES
"""Frames that make a reference, and during which the operator follows its noise."""

_DELAY = 3
"""A touch is certain only when it has stood for so many frames."""

Marked = tuple[Frame, Mark]


class PreRoll:
    """Remembers frames of a run that bring a new pipeline to where the run's is.

    Until ``_KEPT`` frames after a reference these are all frames since. Later the pipeline has
    learnt more than any file would hold: then it is the newest untouched frames, and the run's
    own pipeline takes them for a new reference too, at the frame at which the recording begins.
    """

    def __init__(self) -> None:
        """No frame has come."""
        self._since: list[Marked] = []
        self._complete = True
        self._number = 0
        self._untouched: deque[Frame] = deque(maxlen=_KEPT)
        self._waiting: deque[Frame] = deque()
        self._newest: Frame | None = None

    def frame(self, frame: Frame, mark: Mark, number: int) -> None:
        """A frame and what becomes of it, before the pipeline has it; ``number``: the last
        identity that it has given to a touch."""
        self._newest = None
        if mark & Mark.REFERENCE:
            self._since, self._complete, self._number = [], True, number
            self._untouched.clear()
            self._waiting.clear()
        if mark & (Mark.HELD | Mark.SKIPPED):
            return
        self._newest = frame
        if len(self._since) < _KEPT:
            self._since.append((frame, mark))
        else:
            self._complete = False

    def result(self, result: FrameResult) -> None:
        """What was made of that frame."""
        if self._newest is None or not result.ready or not result.pictured:
            return
        if result.touches or (result.baseline is not None and result.baseline.held):
            self._waiting.clear()
            return
        if result.bend is not None and result.bend.state != "idle":
            return  # a reference is of the straight sheet
        self._waiting.append(self._newest)
        if len(self._waiting) > _DELAY:
            self._untouched.append(self._waiting.popleft())

    def invalidate(self) -> None:
        """The pipeline is no longer what these frames would make of a new one."""
        self._complete = False

    def begin(self, number: int) -> tuple[tuple[Marked, ...], int, bool]:
        """Frames, the last identity before them, and whether the run must go through them too."""
        if self._complete:
            return tuple(self._since), self._number, False
        if len(self._untouched) >= REFERENCE_FRAMES:
            marks = [Mark.REFERENCE] + [Mark.NONE] * (len(self._untouched) - 1)
            self._since = list(zip(self._untouched, marks, strict=True))
        self._since = self._since[:_KEPT]
        self._complete, self._number = True, number
        return tuple(self._since), number, True
