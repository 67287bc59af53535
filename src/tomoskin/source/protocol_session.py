"""The host's side of the protocol: messages and the time in, bytes and events out. No I/O."""

from __future__ import annotations

from enum import Enum, auto

from tomoskin.core import Event, Frame, SourceError
from tomoskin.pattern import Scan
from tomoskin.source.agreement import check_held, check_version, fit_board
from tomoskin.source.command_queue import CommandQueue, SequenceFilter
from tomoskin.source.configuration import Configuration
from tomoskin.source.settings import ScanSettings, Timing
from tomoskin.wire import (
    SCHEMA,
    Ack,
    Fault,
    GetInfo,
    GetPattern,
    GetScan,
    HeldPattern,
    HeldScan,
    Hello,
    Info,
    Message,
    Ping,
    Result,
    SetBaud,
    Stop,
    type_byte,
)


class Stage(Enum):
    """How far the session has come."""

    WAITING = auto()
    SETTING_UP = auto()
    RUNNING = auto()


class ProtocolSession:
    """Waits for HELLO, asks for INFO, sets the scan, reads it back, starts it, keeps it alive.

    A board that says HELLO again has been reset or has missed the heartbeat: it is set up again,
    as is one that answers but has stopped scanning, and one whose line is too fast.

    Attributes
    ----------
    commands
        What is to be sent to the board.
    frames
        The frames that pass, and counts of those that do not.
    stage, info
        How far it has come, and what the board said of itself.
    is_silent
        Whether a board that scans has sent no frame for too long.

    Raises
    ------
    WireError
        From ``receive``: the board speaks another protocol.
    SourceError
        From ``receive``: the board cannot do this scan, refuses a command or holds another scan;
        from ``tick``: it does not answer.
    """

    def __init__(
        self, scan: Scan, settings: ScanSettings, timing: Timing, now: float, where: str
    ) -> None:
        """A session that has not begun."""
        self._scan, self._settings, self._timing, self._where = scan, settings, timing, where
        self.configuration = self._on_board = Configuration.of(scan, settings)
        self.frames = SequenceFilter(self.configuration)
        self.commands = CommandQueue(timing, now, where)
        self.stage = Stage.WAITING
        self.info: Info | None = None
        self.is_silent = False
        self._silence = max(timing.silence, 4 * self.configuration.scan_time)
        self._since = self._last_frame = now
        self._resets = 0
        self._rate: int | None = None

    def take_rate(self) -> int | None:
        """The serial rate that the board has just changed to, once."""
        rate, self._rate = self._rate, None
        return rate

    def fall_back(self, rate: int, now: float) -> Event:
        """Set the board up again at a slower ``rate``, Bd: the line damages what it carries."""
        self._set_up(now, at=rate)
        return Event(
            now, "rate", f"the line damages messages: the board is set up again at {rate:,} Bd"
        )

    def receive(self, message: Message, now: float) -> list[Frame | Event]:
        """Act on a message from the board."""
        match message:
            case Frame():
                return self._frame(message, now)
            case Hello():
                return self._hello(message, now)
            case Info():
                self._info(message, now)
            case HeldScan() | HeldPattern():
                return self._held(message, now)
            case Ack():
                return self._ack(message, now)
            case Fault():
                text = SCHEMA.enums["fault"].sentence(message.code)
                return [Event(now, "fault", f"the board has switched its current off: {text}")]
        return []

    def tick(self, now: float) -> list[Frame | Event]:
        """Act on the time: ask again, keep alive, notice silence."""
        if self.stage is Stage.WAITING and now >= self._since + self._timing.hello:
            self._set_up(now)
        self.commands.repeat(now)
        if self.stage is not Stage.RUNNING:
            return []
        if now >= self.commands.last_sent + self._timing.ping:
            self.commands.send(Ping(0), now)
        if self.is_silent or now < self._last_frame + self._silence:
            return []
        self.is_silent = True
        text = f"no frame for {now - self._last_frame:.1f} s: is the board powered and connected?"
        return [Event(now, "silent", text)]

    def deadline(self) -> float:
        """Time of the next ``tick`` that matters."""
        if self.stage is Stage.WAITING:
            return self._since + self._timing.hello
        if (repeat_time := self.commands.repeat_time) is not None:
            return repeat_time
        ping = self.commands.last_sent + self._timing.ping
        return ping if self.is_silent else min(ping, self._last_frame + self._silence)

    def stop(self, now: float) -> int:
        """Send STOP, whatever is going on; returns its request id."""
        self.frames.close()
        self.commands.clear()
        return self.commands.send(Stop(0), now)

    def _set_up(self, now: float, at: int | None = None) -> None:
        self.stage = Stage.SETTING_UP
        self.info = None
        self.frames.close()
        change = () if at is None else (Stop(0), SetBaud(0, at))
        self.commands.restart((*change, GetInfo(0), Stop(0)), now)

    def _answered(self, now: float) -> list[Frame | Event]:
        """The pending command has been answered: what follows."""
        pending = self.commands.pending
        if isinstance(pending, SetBaud):
            self._rate = pending.baud
        if self.commands.send_next(now):
            return []
        self.stage, self._last_frame, self.is_silent = Stage.RUNNING, now, False
        self.frames.open()
        assert self.info is not None
        return [Event(now, "connected", _introduction(self.info, self.configuration))]

    def _frame(self, frame: Frame, now: float) -> list[Frame | Event]:
        if self.stage is Stage.WAITING:
            self._set_up(now)
        passed = self.frames.take(frame)
        if not any(isinstance(item, Frame) for item in passed):
            return passed
        quiet, was_silent = now - self._last_frame, self.is_silent
        self._last_frame, self.is_silent = now, False
        if was_silent:
            passed.insert(0, Event(now, "resumed", f"frames again after {quiet:.1f} s"))
        return passed

    def _hello(self, hello: Hello, now: float) -> list[Frame | Event]:
        check_version(hello, self._where)
        if self.stage is Stage.SETTING_UP and self.info is None:
            return []
        was_running = self.stage is Stage.RUNNING
        self._resets = 0 if was_running else self._resets + 1
        if self._resets > self._timing.tries:
            raise SourceError(
                "the board resets again and again while it is set up",
                where=self._where,
                hint="is its supply strong enough?",
            )
        self._set_up(now)
        text = "the board has been reset or has missed the heartbeat: it is set up again"
        return [Event(now, "reset", text)] if was_running else []

    def _info(self, info: Info, now: float) -> None:
        pending = self.commands.pending
        if isinstance(pending, GetInfo) and info.request == pending.request:
            check_version(info, self._where)
            fitted = fit_board(info, self._scan, self._settings, self._where)
            self._on_board = self.configuration.on_board(fitted)
            self.info = info
            self.commands.add(self._on_board.commands(info.minor))
            self._answered(now)

    def _held(self, held: HeldScan | HeldPattern, now: float) -> list[Frame | Event]:
        pending = self.commands.pending
        question = GetScan if isinstance(held, HeldScan) else GetPattern
        if not isinstance(pending, question) or held.request != pending.request:
            return []
        check_held(held, self._on_board.behind(pending), self._where)
        return self._answered(now)

    def _ack(self, ack: Ack, now: float) -> list[Frame | Event]:
        pending = self.commands.pending
        if self.is_silent and pending is None:
            # It hears the heartbeat but does not scan: its HELLO or FAULT was lost.
            self.is_silent = False
            self._set_up(now)
            return [Event(now, "reset", "the board answers but does not scan: it is set up again")]
        if pending is None or ack.request != pending.request:
            return []
        if ack.command != type_byte(type(pending)):
            return []
        if ack.result is Result.OK and isinstance(pending, GetScan | GetPattern):
            return []  # no answer to a question
        if ack.result is not Result.OK:
            sentence = SCHEMA.enums["result"].sentence(ack.result)
            raise SourceError(
                f"the board refused {type(pending).__name__}: {sentence} ({ack.detail})",
                where=self._where,
            )
        return self._answered(now)


def _introduction(info: Info, configuration: Configuration) -> str:
    firmware = ".".join(map(str, info.firmware))
    return (
        f"board {info.unique_id.hex()}, firmware {firmware}, "
        f"{info.channels} channels, scans configuration {configuration.identity:04x}"
    )
