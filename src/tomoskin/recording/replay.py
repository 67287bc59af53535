"""The source ``replay``: a session file that answers like the board and sends what it sent."""

from __future__ import annotations

import math
import threading
from collections.abc import Iterator
from dataclasses import replace
from itertools import chain, islice
from pathlib import Path
from typing import TYPE_CHECKING

from tomoskin.core import SourceError
from tomoskin.pattern import Scan
from tomoskin.recording.layout import Mark, MarkedFrame
from tomoskin.recording.playback import Item, Piece, marks, pieces
from tomoskin.recording.references import References
from tomoskin.recording.replay_board import ReplayBoard
from tomoskin.recording.session_reader import SessionReader
from tomoskin.source import Configuration, ScanSettings
from tomoskin.twin import Clock, WallClock
from tomoskin.wire import OLDER, SCHEMA

if TYPE_CHECKING:
    from tomoskin.skin import Skin

_BEFORE = 1.0
"""Seconds before a place that are read to find the first byte of its first frame."""


class ReplayTransport:
    """Bytes of a recorded session, at their own times.

    One thread reads; everything else may be called from any.

    Parameters
    ----------
    session
        Open; closed with the transport.
    skin
        The skin that it will be shown with.
    speed
        Recorded seconds per second; ``inf`` for as fast as it is read.
    loop
        Begin again at the end.
    clock
        The time to keep.

    Raises
    ------
    SourceError
        When the session's frames are not of this skin's scan.
    """

    def __init__(
        self,
        session: SessionReader,
        skin: Skin,
        *,
        speed: float = 1.0,
        loop: bool = False,
        clock: Clock | None = None,
    ) -> None:
        self.name = f"replay:{session.path.name}"
        self._session = session
        self._speed, self._loop = speed, loop
        self._clock = clock or WallClock()
        self._condition = threading.Condition()
        self._board = ReplayBoard(skin, session.device())
        self._restamped = _restamped(session, skin, self.name)
        self.touches_before = session.touches_before
        self._held = self._closed = self._jumped = self.ended = False
        self._steps = 0
        self._marks: dict[int, Mark] = {}
        _ = session.totals  # read now, by one thread
        self._references = References(session.path, session.settings())
        self._go(float("-inf"))
        if self._next is None:
            raise SourceError("holds no frame", where=self.name)
        self._now = self._next.host_time
        own = (p for p in pieces(self._items(self._now), self._now) if not self._is_earlier(p))
        self.start = next(own, self._next).host_time

    @property
    def paused(self) -> bool:
        """Whether it stands still."""
        return self._held

    @property
    def path(self) -> Path:
        """The session."""
        return self._session.path

    @property
    def end(self) -> float:
        """Host time of the last message; of the last frame played where there is no index."""
        totals = self._session.totals
        return self._now if totals is None else totals.last / 1e9 - self._session.epoch

    def now(self) -> float:
        """The time in the recording, host monotonic s: exactly that of what was read last."""
        return self._now

    def jumped(self) -> bool:
        """Whether what was read last does not follow what was read before it."""
        return self._jumped

    def mark(self, sequence: int) -> Mark | None:
        """What became of a frame of the last read when it was recorded; None: never seen."""
        return self._marks.get(sequence)

    def pause(self, on: bool) -> None:
        """Stand still, or go on."""
        with self._condition:
            self._held = on
            self._anchor(self._now)
            self._condition.notify()

    @property
    def speed(self) -> float:
        """Recorded seconds per second; inf for as fast as it is read."""
        return self._speed

    @speed.setter
    def speed(self, speed: float) -> None:
        with self._condition:
            self._anchor(self._now)
            self._speed = speed
            self._condition.notify()

    @property
    def loop(self) -> bool:
        """Whether it begins again at the end."""
        return self._loop

    @loop.setter
    def loop(self, on: bool) -> None:
        with self._condition:
            self._loop = on
            if on and self._next is None:
                self._go(float("-inf"))
            self._condition.notify()

    def step(self) -> None:
        """Play one read and stand still."""
        with self._condition:
            self._held = True
            self._steps += 1
            self._condition.notify()

    def seek(self, host_time: float) -> None:
        """Go on from the first frame at ``host_time``; beyond the last: to the end.

        The frames that made the reference of that moment come first, at once and marked as from
        earlier, so that the pictures are those of the run. A replay that stands still plays the
        frame there.
        """
        made_of = self._references.before(host_time)
        with self._condition:
            self._go(host_time, made_of)
            self._steps = int(self._held)
            self._condition.notify()

    def read(self, timeout: float) -> bytes:
        """The next recorded read, or an answer to a command; ``b""`` if neither in time."""
        stop = self._clock.now() + timeout
        with self._condition:
            while True:
                if self._closed:
                    raise SourceError("the recording has been closed", where=self.name)
                if answer := self._board.answer():
                    self._jumped = False
                    return answer
                now = self._clock.now()
                due = self._due()
                if due <= now:
                    return self._play()
                if now >= stop:
                    self._tell(now)
                    return b""
                self._clock.wait(self._condition, min(due, stop) - now)

    def write(self, data: bytes) -> None:
        """Commands, which are answered as the board would."""
        with self._condition:
            self._board.obey(data)
            self._condition.notify()

    def close(self) -> None:
        """Let go of the file."""
        with self._condition:
            self._closed = True
            self._session.close()
            self._condition.notify()

    def _go(self, host_time: float, earlier: tuple[MarkedFrame, ...] = ()) -> None:
        there = pieces(self._items(host_time - _BEFORE), host_time)
        first = tuple(islice(there, 1))
        before = pieces(map(self._stamped, earlier if first else ()))
        self._pieces = chain(before, first, there)
        self._next = next(self._pieces, None)
        self.ended = self._next is None
        if self._next is not None:
            self._anchor(self._next.host_time)

    def _items(self, since: float) -> Iterator[Item]:
        if self._restamped is None:
            return self._session.reads(since)
        return map(self._stamped, self._session.frames(since))

    def _stamped(self, item: MarkedFrame) -> MarkedFrame:
        if self._restamped is None:
            return item
        return MarkedFrame(replace(item.frame, configuration=self._restamped), item.mark)

    def _anchor(self, host_time: float) -> None:
        self._anchored = (self._clock.now(), host_time)

    def _due(self) -> float:
        """When the next piece is to be read, by the clock; inf: not before something changes."""
        if self._next is None or not self._board.scanning:
            return math.inf
        if self._is_earlier(self._next):
            return -math.inf
        if self._held:
            return -math.inf if self._steps else math.inf
        if math.isinf(self._speed):
            return -math.inf
        wall, host = self._anchored
        return wall + (self._next.host_time - host) / self._speed

    def _is_earlier(self, piece: Piece) -> bool:
        return any(item.mark & Mark.EARLIER for item in piece.frames)

    def _play(self) -> bytes:
        piece = self._next
        assert piece is not None
        if not self._is_earlier(piece):
            self._steps = max(self._steps - 1, 0)
        self._now, self._jumped, self._marks = piece.host_time, not piece.follows, marks(piece)
        self._next = next(self._pieces, None)
        if self._next is None and self._loop:
            self._go(float("-inf"))
        elif self._is_earlier(piece) and self._next is not None:
            self._anchor(self._next.host_time)
        self.ended = self._next is None
        return piece.data

    def _tell(self, now: float) -> None:
        """Let the recording's time go on while nothing is to be read."""
        if self._next is None or self._held or not self._board.scanning or math.isinf(self._speed):
            return
        wall, host = self._anchored
        reached = host + (now - wall) * self._speed
        self._now = max(self._now, min(reached, self._next.host_time))


def open_replay(argument: str, skin: Skin) -> ReplayTransport:
    """``replay:FILE``, ``replay:FILE@2`` (speed), ``replay:FILE@max``, ``replay:FILE@1,loop``.

    Raises
    ------
    SourceError
        For a speed that is none, or a session of another scan.
    DataError
        When the file is no session.
    """
    path, speed, loop = parse_replay(argument)
    session = SessionReader(path)
    try:
        return ReplayTransport(session, skin, speed=speed, loop=loop)
    except BaseException:
        session.close()
        raise


def parse_replay(argument: str) -> tuple[Path, float, bool]:
    """File, speed and whether to begin again, of what stands behind ``replay:``."""
    path, at, rest = argument.rpartition("@")
    if not at or Path(argument).exists():
        path, rest = argument, "1"
    if not path:
        raise SourceError("expected a session file, such as replay:run.mcap", where="replay")
    text, *options = rest.split(",")
    speed = math.inf if text == "max" else _number(text)
    if not speed > 0 or options not in ([], ["loop"]):
        raise SourceError(
            f'expected a speed above 0 or max, then perhaps ,loop, got "@{rest}"',
            where=f"replay:{path}",
            hint="for example replay:run.mcap@2 or replay:run.mcap@1,loop",
        )
    return Path(path), speed, bool(options)


def _number(text: str) -> float:
    try:
        return float(text)
    except ValueError:
        return math.nan


def _restamped(session: SessionReader, skin: Skin, where: str) -> int | None:
    """Identity that the frames must be given to be of this scan; None: they are as they stand.

    The identity covers the commands that set a board, which other versions may send otherwise.
    """
    first = next(session.frames(), None)
    if first is None:
        raise SourceError("holds no frame", where=where)
    configuration = Configuration.of(Scan.of(skin.pattern()), ScanSettings.of(skin))
    same_wire = session.device().get("schema_hash", SCHEMA.hash) in {SCHEMA.hash, *OLDER.values()}
    if first.frame.configuration == configuration.identity and same_wire:
        return None
    same_skin = skin.identity == session.skin.identity
    if same_skin and len(first.frame.samples) == configuration.n_samples:
        return configuration.identity
    raise SourceError(
        f"was recorded by another scan ({first.frame.configuration:04x}) than that of "
        f"{skin.name} ({configuration.identity:04x})",
        where=where,
        hint="leave --skin out: the recording holds its own",
    )
