"""What is kept of a board and its skin from one start to the next: reference and calibrations; and
how a run begins with it, doubts it, and keeps it anew."""

from __future__ import annotations

import threading
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self

from tomoskin.board.wire import Info
from tomoskin.core import Frame, Mark, MarkedFrame, StrPath, TomoskinError, cache_folder
from tomoskin.files.session import SessionReader, SessionWriter, errors_of, recorded_calibrations
from tomoskin.learning import Calibration
from tomoskin.pipeline import REFERENCE_FRAMES, FrameResult, Prepared

if TYPE_CHECKING:
    from tomoskin.run.flow import Flow
    from tomoskin.run.publisher import Publisher


_SPACING = 1e-3
"""Seconds between the host times that frames of the last run get in this one."""

_SIMULATED = b"twin"
"""A twin is made anew with each start: nothing of the one before is in it."""

_MOST_TOUCHES = 3
"""More than these at once, and from the first frame on, are a skin that has changed."""


@dataclass(frozen=True, slots=True, eq=False)
class Remembered:
    """Untouched frames of the last run, its calibrations by kind, and when it was kept, s since
    1970."""

    frames: tuple[Frame, ...]
    calibrations: Mapping[str, Calibration[Any]]
    kept: float


class BoardMemory:
    """Files of boards in a folder, by their unique ids."""

    def __init__(self, folder: StrPath) -> None:
        self.folder = Path(folder)

    @classmethod
    def in_cache(cls) -> Self | None:
        """The one beside the cache; None where nothing is kept on this disk."""
        folder = cache_folder()
        return None if folder is None else cls(folder / "boards")

    def keep(self, board: Info, prepared: Prepared, frames: Sequence[Frame]) -> None:
        """Keep ``frames`` of the untouched skin; nothing where there are too few or no id.

        Raises
        ------
        DataError, OutputError
            When the file cannot be written.
        """
        path = self._path(board)
        if path is None or len(frames) < REFERENCE_FRAMES:
            return
        with errors_of(path):
            self._write(path, prepared, frames)

    def _write(self, path: Path, prepared: Prepared, frames: Sequence[Frame]) -> None:
        self.folder.mkdir(parents=True, exist_ok=True)
        start, fresh = frames[0].host_time, path.with_suffix(".new")
        fresh.unlink(missing_ok=True)
        epoch = time.time() - start
        with SessionWriter(fresh, prepared.skin, epoch=epoch, start=start) as session:
            for one in prepared.calibrations.values():
                session.attach(one.kind.attachment, "application/zip", one.encode())
            for frame in frames:
                session.frame(frame)
        fresh.replace(path)  # all or nothing

    def recall(self, board: Info, prepared: Prepared, now: float) -> Remembered | None:
        """What was kept of a board, its frames as if they came just before ``now``.

        None where there is nothing, or it was of another skin.

        Raises
        ------
        TomoskinError
            When the file is damaged.
        """
        path = self._path(board)
        if path is None or not path.exists():
            return None
        with SessionReader(path) as session:
            if session.skin.body != prepared.skin.body:
                return None
            frames = [item.frame for item in session.frames()]
            calibrations = {one.kind.name: one for one in recorded_calibrations(session)}
            kept = session.epoch + (frames[0].host_time if frames else 0.0)
        if len(frames) < REFERENCE_FRAMES:
            return None
        times = (now - _SPACING * (len(frames) - k) for k in range(len(frames)))
        frames = [replace(f, host_time=t) for f, t in zip(frames, times, strict=True)]
        return Remembered(tuple(frames), calibrations, kept)

    def _path(self, board: Info) -> Path | None:
        number = board.unique_id
        if not number.strip(b"\0") or number.startswith(_SIMULATED):
            return None
        return self.folder / f"{number.hex()}.mcap"


class Trial:
    """Whether the first frames of a run agree with the reference of the one before.

    A skin that reads as it did shows nothing. One that is touched shows a few touches, and is
    waited for until they have gone; until then it is said. Anything else is a skin that has
    changed, and needs a reference of its own.

    Attributes
    ----------
    problem
        What someone should know meanwhile, or None.
    """

    def __init__(self, kept: float) -> None:
        self.problem: str | None = None
        self._since = time.strftime("%Y-%m-%d %H:%M", time.localtime(kept))
        self._quiet = 0

    def push(self, result: FrameResult) -> bool | None:
        """Take the next result: True where the reference holds, False where it does not."""
        sick = result.health is not None and bool(result.health.sick)
        if len(result.touches) > _MOST_TOUCHES or not result.has_image or (
            result.unexplained is not None and not sick
        ):  # fmt: skip
            return False
        self._quiet = 0 if result.touches else self._quiet + 1
        if result.touches:
            self.problem = (
                f"touched since the start, according to the reference of {self._since}: if "
                "nothing touches the skin, take a new reference"
            )
        return True if self._quiet >= REFERENCE_FRAMES else None


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
            flow.marker.reference = True
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
                flow.marker.reference = True
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
        flow.marker.reference = False
        self._trial = Trial(found.kept)
        names = ", ".join(c.kind.name for c in missing)
        what = f"reference and calibrations ({names})" if names else "reference"
        flow.out.say("recalled", f"the board's {what} from its last run are in use again")
