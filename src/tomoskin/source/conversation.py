"""The host's side of the protocol: messages and the time in, bytes and events out. No I/O."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, replace
from enum import Enum, auto

from tomoskin.core import Event, Frame, SourceError
from tomoskin.pattern import Scan
from tomoskin.source.agreement import check_board, check_held, check_version
from tomoskin.source.configuration import Configuration
from tomoskin.source.gate import FrameGate
from tomoskin.source.settings import ScanSettings, Timing
from tomoskin.wire import (
    SCHEMA,
    Ack,
    Command,
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
    encode,
    type_byte,
)


class Stage(Enum):
    """How far the conversation has come."""

    WAITING = auto()
    SETTING_UP = auto()
    RUNNING = auto()


@dataclass
class _Pending:
    command: Command
    sent: float
    tries: int


class Conversation:
    """Waits for HELLO, asks for INFO, sets the scan, reads it back, starts it, keeps it alive.

    A board that says HELLO again has been reset or has missed the heartbeat: it is set up anew,
    as is one that answers but has stopped scanning, and one whose line is too fast.

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
        """A conversation that has not begun."""
        self._scan, self._settings, self._timing, self._where = scan, settings, timing, where
        self.configuration = Configuration.of(scan, settings)
        self.gate = FrameGate(self.configuration)
        self.stage = Stage.WAITING
        self.info: Info | None = None
        self._silence = max(timing.silence, 4 * self.configuration.scan_time)
        self._since = self._last_frame = self._last_sent = now
        self._silent = False
        self._resets = 0
        self._queue: deque[Command] = deque()
        self._pending: _Pending | None = None
        self._request = 0
        self._out = bytearray()
        self._rate: int | None = None

    @property
    def silent(self) -> bool:
        """Whether a board that scans has sent no frame for too long."""
        return self._silent

    def take_rate(self) -> int | None:
        """The serial rate that the board has just changed to, once."""
        rate, self._rate = self._rate, None
        return rate

    def fall_back(self, rate: int, now: float) -> Event:
        """Set the board up anew at a slower ``rate``, Bd: the line damages what it carries."""
        self._set_up(now, at=rate)
        return Event(
            now, "rate", f"the line damages messages: the board is set up anew at {rate:,} Bd"
        )

    def take(self) -> bytes:
        """Bytes to be sent to the board, once."""
        data = bytes(self._out)
        self._out.clear()
        return data

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
        if self._pending and now >= self._pending.sent + self._timing.answer:
            self._ask_again(self._pending, now)
        if self.stage is not Stage.RUNNING:
            return []
        if now >= self._last_sent + self._timing.ping:
            self._send(replace(Ping(0), request=self._next_request()), now)
        if self._silent or now < self._last_frame + self._silence:
            return []
        self._silent = True
        text = f"no frame for {now - self._last_frame:.1f} s: is the board powered and connected?"
        return [Event(now, "silent", text)]

    def deadline(self) -> float:
        """Time of the next ``tick`` that matters."""
        if self.stage is Stage.WAITING:
            return self._since + self._timing.hello
        if self._pending:
            return self._pending.sent + self._timing.answer
        ping = self._last_sent + self._timing.ping
        return ping if self._silent else min(ping, self._last_frame + self._silence)

    def stop(self, now: float) -> int:
        """Send STOP, whatever is going on; returns its request id."""
        self.gate.close()
        self._queue.clear()
        self._pending = None
        command = Stop(self._next_request())
        self._send(command, now)
        return command.request

    def _set_up(self, now: float, at: int | None = None) -> None:
        self.stage = Stage.SETTING_UP
        self.info = None
        self.gate.close()
        change = () if at is None else (Stop(0), SetBaud(0, at))
        self._queue = deque((*change, GetInfo(0), Stop(0)))
        self._ask(now)

    def _ask(self, now: float) -> None:
        command = replace(self._queue.popleft(), request=self._next_request())
        self._pending = _Pending(command, now, 1)
        self._send(command, now)

    def _ask_again(self, pending: _Pending, now: float) -> None:
        name = type(pending.command).__name__
        if pending.tries >= self._timing.tries:
            raise SourceError(
                f"no answer to {name} after {pending.tries} tries",
                where=self._where,
                hint="is it a tomoskin board, powered, at this rate?",
            )
        if isinstance(pending.command, SetBaud):  # it may have gone back: do it again
            pending.command = replace(pending.command, request=self._next_request())
        pending.tries += 1
        pending.sent = now
        self._send(pending.command, now)

    def _answered(self, now: float) -> list[Frame | Event]:
        if self._pending and isinstance(self._pending.command, SetBaud):
            self._rate = self._pending.command.baud
        self._pending = None
        if self._queue:
            self._ask(now)
            return []
        self.stage, self._last_frame, self._silent = Stage.RUNNING, now, False
        self.gate.open()
        return [Event(now, "connected", self._introduction())]

    def _introduction(self) -> str:
        assert self.info is not None
        firmware = ".".join(map(str, self.info.firmware))
        return (
            f"board {self.info.unique_id.hex()}, firmware {firmware}, "
            f"{self.info.channels} channels, scans configuration {self.configuration.identity:04x}"
        )

    def _frame(self, frame: Frame, now: float) -> list[Frame | Event]:
        if self.stage is Stage.WAITING:
            self._set_up(now)
        admitted = self.gate.admit(frame)
        if not any(isinstance(item, Frame) for item in admitted):
            return admitted
        quiet, was_silent = now - self._last_frame, self._silent
        self._last_frame, self._silent = now, False
        if was_silent:
            admitted.insert(0, Event(now, "resumed", f"frames again after {quiet:.1f} s"))
        return admitted

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
        text = "the board has been reset or has missed the heartbeat: it is set up anew"
        return [Event(now, "reset", text)] if was_running else []

    def _info(self, info: Info, now: float) -> None:
        pending = self._pending
        if pending and isinstance(pending.command, GetInfo):
            if info.request != pending.command.request:
                return
            check_version(info, self._where)
            check_board(info, self._scan, self._settings, self._where)
            self.info = info
            self._queue.extend(self.configuration.commands(info.minor))
            self._answered(now)

    def _held(self, held: HeldScan | HeldPattern, now: float) -> list[Frame | Event]:
        pending = self._pending
        question = GetScan if isinstance(held, HeldScan) else GetPattern
        if pending is None or not isinstance(pending.command, question):
            return []
        if held.request != pending.command.request:
            return []
        check_held(held, self.configuration.behind(pending.command), self._where)
        return self._answered(now)

    def _ack(self, ack: Ack, now: float) -> list[Frame | Event]:
        pending = self._pending
        if self._silent and pending is None:
            # It hears the heartbeat but does not scan: its HELLO or FAULT was lost.
            self._silent = False
            self._set_up(now)
            return [Event(now, "reset", "the board answers but does not scan: it is set up anew")]
        if pending is None or ack.request != pending.command.request:
            return []
        if ack.command != type_byte(type(pending.command)):
            return []
        if ack.result is Result.OK and isinstance(pending.command, GetScan | GetPattern):
            return []  # no answer to a question
        if ack.result is not Result.OK:
            sentence = SCHEMA.enums["result"].sentence(ack.result)
            raise SourceError(
                f"the board refused {type(pending.command).__name__}: {sentence} ({ack.detail})",
                where=self._where,
            )
        return self._answered(now)

    def _next_request(self) -> int:
        self._request = self._request % 255 + 1
        return self._request

    def _send(self, command: Command, now: float) -> None:
        self._last_sent = now
        self._out += encode(command)
