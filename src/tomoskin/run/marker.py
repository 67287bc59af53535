"""What becomes of the next frame: as a person wants it, or as it was when it was recorded."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Protocol, runtime_checkable

from tomoskin.board.source import Transport
from tomoskin.core import Frame
from tomoskin.files.session import Mark
from tomoskin.run.commands import ReplayCommand, Seek, SetLoop, SetSpeed
from tomoskin.run.status import ReplayStatus


@runtime_checkable
class ReplaySource(Protocol):
    """A source that plays a recording; its methods may be called from any thread."""

    path: Path
    """The recording."""

    start: float
    """Host time of its first frame, those from before the recording left out."""

    end: float
    """Host time of its last message."""

    speed: float
    """Recorded seconds per second; inf for as fast as it is read."""

    epoch: float
    """What is added to its host times to give seconds since 1970."""

    touches_before: int
    """The last identity that a touch had before it begins."""

    reference_frames: int
    """How many of its frames make a reference."""

    loop: bool
    """Whether it begins again at the end."""

    ended: bool
    """Whether nothing is left to play."""

    @property
    def paused(self) -> bool:
        """Whether the replay is paused."""

    def now(self) -> float:
        """The time in the recording, host monotonic s."""

    def seek(self, host_time: float) -> None:
        """Go on from the first frame at ``host_time``."""

    def step(self) -> None:
        """Play one read and stand still."""

    def mark(self, sequence: int) -> Mark | None:
        """What became of a frame that was just read; None: it never reached the pipeline."""

    def pause(self, on: bool) -> None:
        """Pause the replay, or go on."""


def play(replay: ReplaySource, command: ReplayCommand) -> None:
    """Do what is asked; a seek reads the file up to there when it is the first."""
    if isinstance(command, Seek):
        replay.seek(replay.start + command.at_s)
    elif isinstance(command, SetSpeed):
        replay.speed = math.inf if command.speed is None else command.speed
    elif isinstance(command, SetLoop):
        replay.loop = command.on
    else:
        replay.step()


def replay_status(replay: ReplaySource, *, ended: bool) -> ReplayStatus:
    """Where a replay is; ``ended``: its last frame has been processed."""
    speed = None if math.isinf(replay.speed) else replay.speed
    now, end = replay.now() - replay.start, replay.end - replay.start
    return ReplayStatus(now, max(now, end), speed, replay.loop, ended)


class Marker:
    """Marks each frame with what becomes of it.

    Attributes
    ----------
    replay
        The recording that is being played, or None.
    """

    def __init__(self) -> None:
        """The first frame begins a reference."""
        self.replay: ReplaySource | None = None
        self._reference = True
        self._held = False
        self._opened = False

    @property
    def held(self) -> bool:
        """Whether the picture is to be held, or the replay stands still."""
        return self.replay.paused if self.replay else self._held

    def hold(self, on: bool) -> None:
        """Hold the picture, or let it go on; a replay stands still instead."""
        if self.replay:
            self.replay.pause(on)
        else:
            self._held = on

    def take_reference(self) -> None:
        """The next frame begins a reference."""
        self._reference = True

    def keep_reference(self) -> None:
        """A reference stands: the next frame begins none."""
        self._reference = False

    def begin(self, transport: Transport) -> None:
        """What comes from now on is of ``transport``, which has just been opened."""
        self._opened = True
        self.replay = transport if isinstance(transport, ReplaySource) else None

    def mark(self, frame: Frame, *, late: bool) -> Mark | None:
        """What becomes of ``frame``; ``late``: newer ones wait already. None: leave it out."""
        mark: Mark | None = Mark.NONE
        if self.replay:
            mark = self.replay.mark(frame.sequence)
        elif late:
            mark = Mark.SKIPPED
        elif self._held:
            mark = Mark.HELD
        if mark is None:
            return None
        if self._opened:
            self._opened = False
            mark |= Mark.OPENED
        if self._reference and not mark & Mark.SKIPPED:
            self._reference = False
            mark |= Mark.REFERENCE
        return mark
