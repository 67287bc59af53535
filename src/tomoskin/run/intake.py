"""What comes from the source: frames and events of each read, what was lost, what is repeated; and
what becomes of each frame."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from operator import add
from typing import NamedTuple

from tomoskin.board.source import Link, Received, Transport
from tomoskin.core import Event, Frame, Mark
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
    reference
        Whether the next frame begins a reference.
    """

    def __init__(self) -> None:
        """The first frame begins a reference."""
        self.replay: ReplayTransport | None = None
        self.reference = True
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
        if self.reference and not mark & Mark.SKIPPED:
            self.reference = False
            mark |= Mark.REFERENCE
        return mark


MOST_AT_ONCE = 16
"""Frames of one read that are computed at most: a late picture helps nobody."""

_PROMPT = 1e-3
"""s that a read's first byte has waited at most where the host keeps up."""

_CALM = 100
"""Prompt reads in a row after which more frames are computed at once again."""

PERIOD = 1.0
"""s in which the same event is said once."""

COUNTED = frozenset({"fault", "refused", "late", "deaf"})
"""Kinds of events that a sick board causes in masses; all others are said each time."""

PAUSED = "it is paused: touches follow when it is resumed"

_STANDSTILL = frozenset({"silent", "fault", "reset"})
"""Events after which no frame comes until the board is well again."""


class Losses(NamedTuple):
    """Counts of what did not arrive.

    ``dropped`` frames that the device or this host left out, ``corrupt`` messages damaged on
    the line, ``gaps`` frames missing in the sequence; ``late``, ``deaf`` frames in which the board
    read samples late, or lost bytes of this host.
    """

    dropped: int = 0
    corrupt: int = 0
    gaps: int = 0
    late: int = 0
    deaf: int = 0


class Backlog:
    """How many frames of a read are left out.

    A host that was held up once catches up with all but the oldest. One that goes on being behind
    computes half as many at once each time, until it computes the newest frame alone.
    """

    def __init__(self) -> None:
        self._most, self._calm = MOST_AT_ONCE, 0

    def late(self, frames: int, waited: float) -> int:
        """How many of ``frames`` of a read, the oldest, are left out; ``waited`` s: its first byte
        before it was read."""
        late = max(frames - self._most, 0)
        self._calm = self._calm + 1 if waited <= _PROMPT else 0
        if late and not self._calm:
            self._most = max(self._most // 2, 1)
        elif self._calm >= _CALM:
            self._most, self._calm = min(2 * self._most, MOST_AT_ONCE), 0
        return late


class Repeats:
    """Counts events of one kind and text, which are said once a second with how often they were;
    only of the kinds that are :data:`COUNTED`."""

    def __init__(self) -> None:
        self._said: dict[tuple[str, str], float] = {}
        self._waiting: dict[tuple[str, str], tuple[Event, int]] = {}

    def push(self, now: float, items: Sequence[Received]) -> Iterator[Event]:
        """What is to be said at ``now``, s: of the events of a read, and of those that have
        waited."""
        for event in items:
            if not isinstance(event, Event):
                continue
            key = event.kind, event.text
            if event.kind not in COUNTED:
                yield event
            elif key in self._said and abs(now - self._said[key]) < PERIOD:
                self._waiting[key] = event, self._waiting.get(key, (event, 0))[1] + 1
            else:
                yield self._counted(now, event, 1 + self._waiting.pop(key, (event, 0))[1])
        for key, (event, count) in list(self._waiting.items()):
            if key not in self._said or abs(now - self._said[key]) >= PERIOD:
                del self._waiting[key]
                yield self._counted(now, event, count)

    def _counted(self, now: float, event: Event, count: int) -> Event:
        self._said = {key: time for key, time in self._said.items() if abs(now - time) < PERIOD}
        self._said[event.kind, event.text] = now
        return event if count == 1 else replace(event, text=f"{event.text} ({count} times)")


class Intake:
    """The reads of one source after the other.

    Attributes
    ----------
    polled, waited
        Host time of the newest read, s, and how long its first byte had waited, s.
    standstill
        Why no frame comes until the board is well again, or None.
    skipped
        Frames that this host has left out.
    backlog, repeats
        How many frames of a read are left out; events that come again and again.
    """

    def __init__(self) -> None:
        self.polled, self.waited = 0.0, 0.0
        self.standstill: str | None = None
        self.skipped = 0
        self._link: Link | None = None
        self._drops, self._earlier = 0, Losses()
        self.backlog, self.repeats = Backlog(), Repeats()

    def open(self) -> None:
        """A protocol session is to begin."""
        self.standstill, self._drops = None, 0

    def close(self) -> None:
        """The protocol session is over; another may follow."""
        self._earlier, self._link = self.losses, None

    @property
    def losses(self) -> Losses:
        """All that did not arrive, but what this host has left out; from any thread."""
        link = self._link
        if link is None:
            return self._earlier
        frames = link.frames
        now = (
            self._drops + frames.foreign,
            link.counters.corrupt,
            frames.lost,
            frames.late,
            frames.deaf,
        )
        return Losses(*map(add, self._earlier, now))

    def take(self, link: Link, items: Sequence[Received], now: float) -> int:
        """Take a read of ``link`` that was made at ``now``, host s; how many frames it brought."""
        self._link, self.polled, self.waited = link, now, link.waited
        frames = 0
        for item in items:
            if isinstance(item, Frame):
                frames += 1
                self._drops = item.drops
            elif isinstance(item, Event) and item.kind in _STANDSTILL:
                self.standstill = item.text
        return frames
