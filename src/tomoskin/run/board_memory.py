"""What is kept of a board and its skin from one start to the next: reference and calibrations.

It is a session file of a second or so: the newest untouched frames, with the calibrations that
were on. A run begins with these frames as if it had just read them; so reference, noise and the
electrodes' health are those of the end of the last run, and a replay goes the same way.
"""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from tomoskin.board.wire import Info
from tomoskin.core import Frame, StrPath
from tomoskin.files.session import SessionReader, SessionWriter, errors_of, recorded_calibrations
from tomoskin.learning import Calibration
from tomoskin.pipeline import REFERENCE_FRAMES, FrameResult, Prepared

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
