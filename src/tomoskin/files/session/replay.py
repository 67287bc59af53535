"""The source ``replay``: a session file that answers like the board and sends what it sent."""

from __future__ import annotations

import math
import re
import threading
from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

from tomoskin.board import wire
from tomoskin.board.source import Configuration, ScanSettings
from tomoskin.board.wire import OLDER, SCHEMA
from tomoskin.core import Clock, DataError, Mark, MarkedFrame, SourceError, WallClock
from tomoskin.files.session.info import References
from tomoskin.files.session.layout import Truth
from tomoskin.files.session.playback import Item, Playhead
from tomoskin.files.session.session_reader import (
    SessionReader,
    end_time,
    reference_frames,
    start_time,
    stated_rate,
    touches_before,
)
from tomoskin.model.pattern import Scan
from tomoskin.model.skin import Skin
from tomoskin.twin import Board, HeldScanning, Question, Setting

_MOST = 2**16 - 1


class ReplayBoard:
    """Answers commands as the board that was recorded would; no I/O.

    ``scanning`` says whether it has been started.
    """

    def __init__(self, skin: Skin, device: dict[str, Any]) -> None:
        """``device`` is what the session holds of the board, perhaps nothing."""
        self._held = HeldScanning(_board(skin, device))
        self._deframer = wire.Deframer(wire.SCHEMA.to_device_bytes)
        self._out = bytearray(
            wire.encode(wire.Hello(wire.SCHEMA.major, wire.SCHEMA.minor, wire.SCHEMA.hash))
        )
        self.scanning = False

    def obey(self, data: bytes) -> None:
        """Carry out the commands that these bytes hold."""
        for payload in self._deframer.feed(data):
            command = wire.decode_payload(payload, 0.0)
            if command is not None and wire.is_command(command):
                self._out += wire.encode(self._answer(command))

    def answer(self) -> bytes:
        """The answers that wait, each once."""
        data = bytes(self._out)
        self._out.clear()
        return data

    def _answer(self, command: wire.Command) -> wire.Message:
        if isinstance(command, Question):
            return self._held.answer(command)
        if isinstance(command, Setting):
            self._held.set(command)
        elif isinstance(command, wire.Start | wire.Stop):
            self.scanning = isinstance(command, wire.Start)
        return wire.Ack(command.request, wire.type_byte(type(command)), wire.Result.OK, 0)


def _board(skin: Skin, device: dict[str, Any]) -> Board:
    """A board that is what was recorded, and has room for any scan.

    It has never fewer channels than the skin has electrodes.
    """
    channels = device.get("channels")
    name = str(device.get("name") or "").encode()[:24]
    return Board(
        channels=max(channels if isinstance(channels, int) else 0, skin.n_electrodes),
        adc_bits=skin.readout.adc_bits,
        current=skin.current,
        tick_rate=round(stated_rate(device, skin)),
        max_drives=_MOST,
        max_samples=_MOST,
        firmware=_version(device.get("firmware")),
        unique_id=_identity(device.get("unique_id")),
        limits=wire.BoardLimits(0, name.ljust(24, b"\0"), 0, _MOST, 0, 0, 0, 0),
    )


def _version(text: Any) -> tuple[int, int, int]:
    """Three numbers of "1.2.3"; zeros where it says no such."""
    parts = str(text or "").split(".")
    is_version = len(parts) == 3 and all(part.isdigit() and int(part) < 256 for part in parts)
    major, minor, patch = map(int, parts) if is_version else (0, 0, 0)
    return major, minor, patch


def _identity(text: Any) -> bytes:
    try:
        identity = bytes.fromhex(str(text or ""))
    except ValueError:
        identity = b""
    return identity if len(identity) == 8 else b"replay\0\0"


_SHORTEST = 1e-6
"""No wait is shorter, s: a piece is played so much earlier, or time would stand still."""


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
        Recorded seconds per second; ``inf`` for as fast as it is read. It may be set at any time.
    loop
        Begin again at the end. It may be set at any time.
    clock
        The time to keep.

    Attributes
    ----------
    path
        The session.
    start
        Host time of its first frame, those from before the recording left out.
    paused
        Whether it stands still.
    touches_before, reference_frames
        The last identity that a touch had before it begins, and the frames that make a reference.
    truth
        What pressed on a twin, each time that it changed; nothing where the session has no index,
        since all of it would have to be read.

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
        self.path, self.name = session.path, f"replay:{session.path.name}"
        self.speed, self.loop, self.paused = speed, loop, False
        self.touches_before, self.epoch = touches_before(session), session.epoch
        self.reference_frames = reference_frames(session.settings())
        self._session, self._clock = session, clock or WallClock()
        self._condition = threading.Condition()
        self._board = ReplayBoard(skin, session.device())
        self._stamp = _stamp_of(session, skin, self.name)
        self._references = References(session.path, session.settings())
        self._head = Playhead(partial(_items, session, self._stamp))
        self._end = end_time(session)
        self.truth = () if self._end is None else _truth_of(session)
        self._wall = self._clock.now()
        self._steps = 0
        self._closed = self._after_seek = False
        self.start = start_time(session) or self._head.now

    @property
    def ended(self) -> bool:
        """Whether nothing is left to play."""
        return self._head.next is None and not self.loop

    @property
    def damage(self) -> DataError | None:
        """What is wrong with the file where it could be played no further, or None."""
        return self._head.damage

    @property
    def end(self) -> float:
        """Host time of the last message; of the last frame played where there is no index."""
        return self._head.now if self._end is None else self._end

    def now(self) -> float:
        """The time in the recording, host monotonic s: exactly that of what was read last."""
        return self._head.now

    def after_seek(self) -> bool:
        """Whether what was read last does not follow what was read before it."""
        return self._after_seek

    def mark(self, sequence: int) -> Mark | None:
        """What became of a frame of the last read when it was recorded; None: never processed."""
        last = self._head.last
        return last.mark(sequence) if last else None

    def pause(self, on: bool) -> None:
        """Let the replay stand still, or go on."""
        with self._condition:
            self.paused = on
            self._condition.notify()

    def step(self) -> None:
        """Play one read and stand still."""
        with self._condition:
            self.paused = True
            self._steps += 1
            self._condition.notify()

    def seek(self, host_time: float) -> None:
        """Go on from the first frame at ``host_time``; beyond the last: to the end.

        The frames that made the reference of that moment come first, at once and marked as from
        earlier, so that the images are those of the run. A replay that stands still plays the
        frame there.
        """
        made_of = self._references.before(host_time)
        with self._condition:
            self._head.seek(host_time, map(self._stamp, made_of) if self._stamp else made_of)
            self._steps = int(self.paused)
            self._condition.notify()

    def read(self, timeout: float) -> bytes:
        """The next recorded read, or an answer to a command; ``b""`` if neither in time."""
        stop = self._clock.now() + (max(timeout, _SHORTEST) if timeout else 0.0)
        with self._condition:
            while True:
                if self._closed:
                    raise SourceError("the recording has been closed", where=self.name)
                if answer := self._board.answer():
                    self._after_seek = False
                    return answer
                now = self._clock.now()
                patience = self._patience(now)
                if patience < _SHORTEST:
                    return self._play()
                if now >= stop:
                    return b""
                self._clock.wait(self._condition, min(patience, stop - now))

    def write(self, data: bytes) -> None:
        """Commands, which are answered as the board would."""
        with self._condition:
            self._board.obey(data)
            self._condition.notify()

    def close(self) -> None:
        """Close the file, and end every read that waits."""
        with self._condition:
            self._closed = True
            self._session.close()
            self._condition.notify()

    def _patience(self, now: float) -> float:
        """Seconds until the next piece is due; inf: not before something changes."""
        elapsed, self._wall = now - self._wall, now
        if self._head.next is None and self.loop:
            self._head.seek(-math.inf)
        if self._head.next is None or not self._board.scanning:
            return math.inf
        if self._head.next.is_earlier:
            return 0.0
        if self.paused:
            return 0.0 if self._steps else math.inf
        if math.isinf(self.speed):
            return 0.0
        return self._head.advance(elapsed * self.speed) / self.speed

    def _play(self) -> bytes:
        piece = self._head.play()
        if not piece.is_earlier:
            self._steps = max(self._steps - 1, 0)
        self._after_seek = not piece.follows
        return piece.data


def open_replay(argument: str, skin: Skin) -> ReplayTransport:
    """``replay:FILE``, ``replay:FILE@2`` (speed), ``replay:FILE@max``, each perhaps with ``,loop``.

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


_SPEED, _OPTION = r"@(?P<speed>[^@,/\\]*)", r",(?P<option>[^@,/\\]*)"
_TAILS = ("", _OPTION, _SPEED, _SPEED + _OPTION)
"""What may stand behind the file of a replay."""


def parse_replay(argument: str) -> tuple[Path, float, bool]:
    """File, speed and whether to begin again, of what stands behind ``replay:``."""
    matches = [m for tail in _TAILS if (m := re.fullmatch(f"(.+?){tail}", argument, re.DOTALL))]
    if not matches:
        raise SourceError(
            "expected a session file, such as replay:run.mcap; got none", where="replay"
        )
    # what is called so is meant, whatever is in its name
    match = next((m for m in matches if Path(m[1]).exists()), matches[-1])
    path, words = match[1], match.groupdict()
    text, option = words.get("speed", "1"), words.get("option", "loop")
    speed = math.inf if text == "max" else _number(text)
    if not speed > 0 or option != "loop":
        raise SourceError(
            "expected @SPEED (above 0, or max), ,loop or both behind the file, got "
            f'"{argument.removeprefix(path)}"',
            where=f"replay:{path}",
            hint="for example replay:run.mcap,loop or replay:run.mcap@2,loop",
        )
    return Path(path), speed, "option" in words


def _number(text: str) -> float:
    try:
        return float(text)
    except ValueError:
        return math.nan


def _stamp_of(
    session: SessionReader, skin: Skin, where: str
) -> Callable[[MarkedFrame], MarkedFrame] | None:
    """What makes the frames those of this scan; None: they are as they stand.

    The identity of a scan covers the commands that set a board, which other versions may send
    otherwise.
    """
    first = next(session.frames(), None)
    if first is None:
        raise SourceError("holds no frame", where=where)
    configuration = Configuration.of(Scan.of(skin.pattern()), ScanSettings.of(skin))
    same_wire = session.device().get("schema_hash", SCHEMA.hash) in {SCHEMA.hash, *OLDER.values()}
    if first.frame.configuration == configuration.identity and same_wire:
        return None
    same_skin = skin.body == session.skin.body
    if not same_skin or len(first.frame.samples) != configuration.n_samples:
        raise SourceError(
            f"was recorded with another scan ({first.frame.configuration:04x}) than that of "
            f"{skin.name} ({configuration.identity:04x})",
            where=where,
            hint="leave out --skin: the recording holds its own skin",
        )

    def stamp(item: MarkedFrame) -> MarkedFrame:
        frame = replace(item.frame, configuration=configuration.identity)
        return MarkedFrame(frame, item.mark)

    return stamp


def _truth_of(session: SessionReader) -> tuple[Truth, ...]:
    """As far as it can be read: frames are played without it too."""
    presses: list[Truth] = []
    with suppress(DataError):
        presses.extend(session.truth())
    return tuple(sorted(presses, key=lambda truth: truth.host_time))


def _items(
    session: SessionReader, stamp: Callable[[MarkedFrame], MarkedFrame] | None, since: float
) -> Iterator[Item]:
    """Recorded reads with their frames; frames alone where their bytes are of another scan."""
    return session.reads(since) if stamp is None else map(stamp, session.frames(since))
