"""A run remembers its board: begins with what was kept of it, doubts that, and keeps it anew."""

from __future__ import annotations

import threading
from typing import TYPE_CHECKING

from tomoskin.board.wire import Info
from tomoskin.core import Mark, MarkedFrame, TomoskinError
from tomoskin.pipeline import FrameResult, Prepared
from tomoskin.run.board_memory import BoardMemory, Remembered, Trial
from tomoskin.run.publisher import Publisher

if TYPE_CHECKING:
    from tomoskin.run.flow import Flow

_OFTEN = 60.0
"""Seconds after which a run is kept, in case that it ends without a word."""


class Recall:
    """What one run does with the memory of boards; ``memory`` None: nothing.

    Used by the run's thread; what is kept is written by another.
    """

    def __init__(self, memory: BoardMemory | None) -> None:
        self._memory = memory
        self._board: Info | None = None
        self._trial: Trial | None = None
        self._kept = float("-inf")
        self._writer: threading.Thread | None = None

    @property
    def problem(self) -> str | None:
        """What someone should know of the reference, or None."""
        return None if self._trial is None else self._trial.problem

    def meet(self, board: Info, flow: Flow) -> None:
        """A board has said what it is: the first one, the same again, or another."""
        before, self._board = self._board, board
        if before is not None and before.unique_id != board.unique_id:
            flow.out.say("other-board", "another board answers: a new reference is taken")
            flow.marker.take_reference()
        if before is not None and before.unique_id == board.unique_id:
            return
        self._trial = None
        if self._memory is None:
            return
        now = flow.now()
        self._kept = now
        try:
            found = self._memory.recall(board, flow.prepared, now)
        except TomoskinError as error:
            flow.out.say(
                "not-recalled",
                f"the saved reference and calibrations of this board cannot be used: {error}",
            )
            return
        if found is not None:
            self._begin(found, flow)

    def see(self, result: FrameResult, flow: Flow) -> None:
        """A frame has been followed: does it agree with the reference that was recalled?"""
        if self._trial is not None and result.ready:
            holds = self._trial.push(result)
            if holds is not None:
                self._trial = None
            if holds is False:
                flow.out.say(
                    "reference-renewed",
                    "the skin has changed since this board's last run: a new reference is taken; "
                    "do not touch the skin",
                )
                flow.marker.take_reference()
        if self.is_due(result.host_time):
            self._kept = result.host_time
            if self._writer is None or not self._writer.is_alive():
                self._writer = threading.Thread(
                    target=self.keep, args=(flow.prepared, flow.out), name="tomoskin-memory"
                )
                self._writer.start()

    def is_due(self, now: float, *, at_end: bool = False) -> bool:
        """Whether the run is to be kept, as far as it is sure of its reference."""
        known = self._memory is not None and self._board is not None and self._trial is None
        return known and (at_end or now > self._kept + _OFTEN)

    def keep(self, prepared: Prepared, out: Publisher) -> None:
        """Keep the newest untouched frames; what goes wrong is said."""
        assert self._memory is not None
        assert self._board is not None
        try:
            self._memory.keep(self._board, prepared, out.recordings.untouched)
        except TomoskinError as error:
            out.say(
                "not-kept",
                "reference and calibrations of this board could not be saved for the next start: "
                f"{error}",
            )

    def _begin(self, found: Remembered, flow: Flow) -> None:
        """Go on where the last run of the board ended."""
        missing = [c for k, c in found.calibrations.items() if k not in flow.prepared.calibrations]
        if missing and flow.out.recordings.path is None:
            prepared = flow.prepared
            for calibration in missing:
                prepared = prepared.calibrated(calibration)
            flow.adopt(prepared)
        elif missing:
            flow.out.say(
                "not-recalled",
                "the board's saved calibrations are not used, because a recording is running",
            )
        for number, frame in enumerate(found.frames):
            mark = Mark.EARLIER | (Mark.NONE if number else Mark.REFERENCE)
            flow.out.put(MarkedFrame(frame, mark))
            flow.pipeline.push(frame, mark)
        flow.marker.keep_reference()
        self._trial = Trial(found.kept)
        names = ", ".join(c.kind.name for c in missing)
        what = f"reference and calibrations ({names})" if names else "reference"
        flow.out.say("recalled", f"the board's {what} from its last run are in use again")
