"""What becomes of the next frame: as a person wants it, or as it was when it was recorded."""

from __future__ import annotations

import math

from tomoskin.board.source import Transport
from tomoskin.core import Frame, Mark
from tomoskin.files.session import ReplayTransport
from tomoskin.run.commands import ReplayCommand, Seek, SetLoop, SetSpeed
from tomoskin.run.status import ReplayStatus


def play(replay: ReplayTransport, command: ReplayCommand) -> None:
    """Do what is asked; a seek reads the file up to there when it is the first."""
    if isinstance(command, Seek):
        replay.seek(replay.start + command.at_s)
    elif isinstance(command, SetSpeed):
        replay.speed = math.inf if command.speed is None else command.speed
    elif isinstance(command, SetLoop):
        replay.loop = command.on
    else:
        replay.step()


def replay_status(replay: ReplayTransport, *, ended: bool) -> ReplayStatus:
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
        self.replay: ReplayTransport | None = None
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
        self.replay = transport if isinstance(transport, ReplayTransport) else None

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
