"""The host's side of the protocol: messages and the time in, bytes and events out; and the frames
that full turns of single drives make. No I/O."""

from __future__ import annotations

from dataclasses import replace
from enum import Enum, auto

import numpy as np

from tomoskin.board import wire
from tomoskin.board.source.agreement import (
    BOARDS_SINCE,
    check_held,
    check_reference,
    check_version,
    fit_board,
)
from tomoskin.board.source.boards import board_named
from tomoskin.board.source.command_queue import CommandQueue, SequenceFilter
from tomoskin.board.source.settings import Configuration, ScanSettings, Timing, choose_periods
from tomoskin.core import DriveSamples, Event, Frame, SourceError
from tomoskin.model.pattern import Scan

_ANSWERED: dict[type[wire.Message], type[wire.Command]] = {
    wire.HeldScan: wire.GetScan,
    wire.HeldPattern: wire.GetPattern,
    wire.HeldMode: wire.GetMode,
}
"""What each answer of what a board holds was asked by."""


_MOST_BROKEN = 20
"""Full turns in a row that lack a drive, after which shorter whole scans are asked for."""


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
    configuration
        What the scan asks of the board, fitted to the board once that is known.
    commands
        What is to be sent to the board.
    frames, drives
        The frames and the drives that pass, and counts of those that do not.
    stage, info, board
        How far it has come, and what the board said of itself; ``board`` from protocol 1.2 on.
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
        self.configuration = Configuration.of(scan, settings)
        self.frames = SequenceFilter(self.configuration)
        self.drives = Assembler(self.frames, len(scan.drives), asked=settings.singly)
        self.commands = CommandQueue(timing, now, where)
        self.stage = Stage.WAITING
        self.info: wire.Info | None = None
        self.board: wire.BoardLimits | None = None
        self._met: tuple[wire.Info, ScanSettings] | None = None
        self.is_silent = False
        self._overdue = False
        self._silence = max(timing.silence, 4 * self.configuration.scan_time)
        self._since = self._last_frame = now
        self._resets = 0

    def fall_back(self, rate: int, now: float) -> Event:
        """Set the board up again at a slower ``rate``, Bd: the line damages what it carries."""
        self._set_up(now, at=rate)
        return Event(
            now,
            "rate",
            f"messages arrive damaged: the board is set up again at the slower rate of {rate:,} Bd",
        )

    def receive(self, message: wire.Message, now: float) -> list[Received]:
        """Act on a message from the board."""
        self._overdue = False
        match message:
            case Frame() | DriveSamples():
                return self._samples(message, now)
            case wire.Hello():
                return self._hello(message, now)
            case wire.Info():
                self._info(message, now)
            case wire.BoardLimits() | wire.HeldScan() | wire.HeldPattern() | wire.HeldMode():
                return self._losses(message, now)
            case wire.Ack():
                return self._ack(message, now)
            case wire.Fault():
                text = wire.SCHEMA.enums["fault"].sentence(message.code)
                return [Event(now, "fault", f"the board has switched its current off: {text}")]
        return []

    def tick(self, now: float) -> list[Received]:
        """Act on the time: ask again, keep alive, notice silence."""
        if self.stage is Stage.WAITING and now >= self._since + self._timing.hello:
            self._set_up(now)
        self.commands.repeat(now)
        if self.stage is not Stage.RUNNING:
            return []
        self.commands.keep_alive(now)
        if self.is_silent or now < self._last_frame + self._silence:
            return []
        if not self._overdue:  # a busy host may not have read yet what has come
            self._overdue = True
            return []
        if self.drives.unsaid and self.configuration.singly:
            return self._go_whole(now)
        self.is_silent = True
        text = f"no frame for {now - self._last_frame:.1f} s: check the board's power and cable"
        return [Event(now, "silent", text)]

    def deadline(self) -> float:
        """Time of the next ``tick`` that matters."""
        if self.stage is Stage.WAITING:
            return self._since + self._timing.hello
        if (repeat_time := self.commands.repeat_time) is not None:
            return repeat_time
        ping = self.commands.last_sent + self._timing.ping
        return ping if self.is_silent else min(ping, self._last_frame + self._silence)

    def _set_up(self, now: float, at: int | None = None) -> None:
        self.stage = Stage.SETTING_UP
        self.info = self.board = self._met = None
        self.frames.close()
        change = () if at is None else (wire.Stop(0), wire.SetBaud(0, at))
        self.commands.restart((*change, wire.GetInfo(0), wire.Stop(0)), now)

    def _answered(self, now: float) -> list[Received]:
        """The pending command has been answered: what follows."""
        if self.commands.send_next(now):
            return []
        self.stage, self._last_frame, self.is_silent = Stage.RUNNING, now, False
        self.frames.open()
        self.drives.forget()
        self.drives.broken = 0
        assert self.info is not None
        text = _introduction(self.info, self.board, self.configuration)
        return [Event(now, "connected", text)]

    def _samples(self, samples: Frame | DriveSamples, now: float) -> list[Received]:
        if self.stage is Stage.WAITING:
            self._set_up(now)
        passed: list[Received] = []
        if whole := isinstance(samples, Frame):
            passed += self.frames.take(samples)
        else:
            passed += self.drives.take(samples)
        if not passed or isinstance(passed[-1], Event):
            return passed
        self.drives.unsaid &= whole
        quiet, was_silent = now - self._last_frame, self.is_silent
        self._last_frame, self.is_silent = now, False
        if was_silent:
            passed.insert(0, Event(now, "resumed", f"frames arrive again after {quiet:.1f} s"))
        if self.drives.broken >= _MOST_BROKEN and self.configuration.singly:
            return passed + self._go_whole(now)
        if not self._settings.singly:  # nobody has asked for the drives of this recording
            return [item for item in passed if not isinstance(item, DriveSamples)]
        return self.drives.say_whole(now) + passed if whole else passed

    def _go_whole(self, now: float) -> list[Received]:
        """Set the board up again for whole scans, since drives do not come, or not all."""
        self.drives.unsaid = True
        self._settings = replace(self._settings, singly=False)
        self._set_up(now)
        return self.drives.say_whole(now)

    def _hello(self, hello: wire.Hello, now: float) -> list[Received]:
        check_version(hello, self._where)
        if self.stage is Stage.SETTING_UP and self.info is None:
            return []
        was_running = self.stage is Stage.RUNNING
        self._resets = 0 if was_running else self._resets + 1
        if self._resets > self._timing.tries:
            raise SourceError(
                "the board resets repeatedly while it is set up",
                where=self._where,
                hint="check that its power supply is strong enough",
            )
        self._set_up(now)
        text = "the board was reset or missed the heartbeat: it is set up again"
        return [Event(now, "reset", text)] if was_running else []

    def _info(self, info: wire.Info, now: float) -> None:
        pending = self.commands.pending
        if isinstance(pending, wire.GetInfo) and info.request == pending.request:
            check_version(info, self._where)
            fitted = fit_board(info, self._scan, self._settings, self._where)
            if info.minor < BOARDS_SINCE:  # that is all that it says of itself
                self.info, self.configuration = info, self.configuration.on_board(fitted)
                self.commands.add(self.configuration.commands(info.minor))
            else:
                self._met = info, fitted
                self.commands.add((wire.GetBoard(0),))
            self._answered(now)

    def _losses(
        self,
        message: wire.BoardLimits | wire.HeldScan | wire.HeldPattern | wire.HeldMode,
        now: float,
    ) -> list[Received]:
        if isinstance(message, wire.BoardLimits):
            return self._limits(message, now)
        return self._held(message, now)

    def _limits(self, board: wire.BoardLimits, now: float) -> list[Received]:
        pending = self.commands.pending
        asked = isinstance(pending, wire.GetBoard) and board.request == pending.request
        if not asked or self._met is None:
            return []
        info, fitted = self._met
        doubt = check_reference(board_named(board.text), self._scan, fitted, self._where)
        channels = int(np.bincount(self._scan.sample_drive).max())
        periods = choose_periods(board, fitted, channels, info.tick_rate, self._where)
        self.info, self.board = info, board
        self.configuration = self.configuration.on_board(fitted, board, periods)
        self.commands.add(self.configuration.commands(info.minor))
        self._answered(now)
        return [Event(now, "driven-reference", doubt)] if doubt else []

    def _held(
        self, held: wire.HeldScan | wire.HeldPattern | wire.HeldMode, now: float
    ) -> list[Received]:
        pending = self.commands.pending
        if not isinstance(pending, _ANSWERED[type(held)]) or held.request != pending.request:
            return []
        check_held(held, self.configuration.behind(pending), self._where)
        return self._answered(now)

    def _ack(self, ack: wire.Ack, now: float) -> list[Received]:
        pending = self.commands.pending
        if self.is_silent and pending is None:
            # It hears the heartbeat but does not scan: its HELLO or FAULT was lost.
            self.is_silent = False
            self._set_up(now)
            return [Event(now, "reset", "the board answers but does not scan: it is set up again")]
        if pending is None or ack.request != pending.request:
            return []
        if ack.command != wire.type_byte(type(pending)):
            return []
        if ack.result is wire.Result.OK and isinstance(pending, _QUESTIONS):
            return []  # no answer to a question
        return (
            self._answered(now)
            if ack.result is wire.Result.OK
            else self._refused(ack, pending, now)
        )

    def _refused(self, ack: wire.Ack, command: wire.Command, now: float) -> list[Received]:
        """The board has refused the pending command: goes on without it where that is possible."""
        if isinstance(command, wire.SetFormat) and self.drives.unsaid:
            return self._go_whole(now)
        raise SourceError(
            f"the board refused {type(command).__name__}: {_reason(ack, command)}",
            where=self._where,
        )


_QUESTIONS = (wire.GetBoard, *_ANSWERED.values())


def _reason(ack: wire.Ack, refused: wire.Command) -> str:
    """Why: the field of a value that is out of range by its name, with what the protocol allows."""
    number = wire.type_byte(type(refused))
    message = next(message for message in wire.SCHEMA.messages if message.type == number)
    if ack.result is not wire.Result.BAD_VALUE or ack.detail >= len(message.fields):
        return f"{wire.SCHEMA.enums['result'].sentence(ack.result)} ({ack.detail})"
    field = message.fields[ack.detail]
    value = f"{getattr(refused, field.name)} {field.unit}".strip()
    return f"{field.name} of {value} is out of range ({field.text})"


def _introduction(
    info: wire.Info, board: wire.BoardLimits | None, configuration: Configuration
) -> str:
    firmware = ".".join(map(str, info.firmware))
    name = f"{board.text} " if board else ""
    return (
        f"board {name}{info.unique_id.hex()}, firmware {firmware}, "
        f"{info.channels} channels, scans configuration {configuration.identity:04x}"
    )


_MODULUS = 2**32

Received = Frame | DriveSamples | Event
"""What comes from a board: scans, drives of them where these are sent one by one, and events."""


class Assembler:
    """Passes drives on at once, and behind the last of a full turn its frame.

    A drive that is late, doubled, or of another scan is left out and counted, as a frame is. A turn
    that lacks a drive makes no frame and is counted as lost.

    ``broken`` is how many full turns in a row have lacked a drive; ``unsaid`` whether drives are
    asked for, none has come yet, and nobody has been told so.
    """

    def __init__(self, frames: SequenceFilter, n_drives: int, *, asked: bool = True) -> None:
        """``frames`` is the filter that drives and frames go through."""
        self._frames, self._n_drives = frames, n_drives
        self.unsaid = asked
        self.forget()

    def say_whole(self, now: float) -> list[Received]:
        """Scans come whole though drives were asked for: an event says so once."""
        unsaid, self.unsaid = self.unsaid, False
        text = "the board sends whole scans only: a touch shows at the end of its first scan"
        return [Event(now, "whole-scans", text)] if unsaid else []

    def forget(self) -> None:
        """What comes next does not follow what came before."""
        self.broken = 0
        self._last: DriveSamples | None = None
        self._turn: list[DriveSamples] | None = None
        """The drives of a full turn that lacks none so far."""

    def take(self, drive: DriveSamples) -> list[Received]:
        """The drive and the frame that it completes, or nothing; and an event if some is wrong."""
        events = self._frames.refuse(drive)
        if events is not None:
            return [*events]
        last, counters = self._last, self._frames.counters
        ahead = (drive.sequence - last.sequence) % _MODULUS if last else 1
        if last and ahead == 0 and _head(drive) != _head(last):
            counters.foreign += 1
            self._turn = None
            return []
        if last and (ahead >= _MODULUS // 2 or (ahead == 0 and drive.place <= last.place)):
            counters.stale += 1
            return []
        self._last = drive
        items: list[Received] = []
        if last is None or ahead:
            items += self._begin(drive, last)
        elif drive.place > last.place + 1:
            self._turn = None
        return items + self._complete(drive)

    def _begin(self, drive: DriveSamples, last: DriveSamples | None) -> list[Event]:
        """A turn begins after that of ``last``, with its first drive or a later one."""
        whole = self._turn is not None and len(self._turn) == self._n_drives
        if last and not whole:
            self.broken += 1
        self._turn = None if drive.place else []
        return self._frames.reach(drive)

    def _complete(self, drive: DriveSamples) -> list[Received]:
        """The drive, and the frame if it is the last one of a turn that lacks none."""
        if self._turn is None:
            return [drive]
        self._turn.append(drive)
        if drive.place < self._n_drives - 1:
            return [drive]
        self.broken = 0
        return [drive, *self._frames.take(_frame(self._turn))]


def _head(drive: DriveSamples) -> tuple[int, int]:
    """What all drives of a turn have in common."""
    return drive.flags, drive.drops


def _frame(turn: list[DriveSamples]) -> Frame:
    """The frame of a full turn: that which a board sends whole."""
    first, sums = turn[0], [drive.sums for drive in turn if drive.sums is not None]
    return Frame(
        sequence=first.sequence,
        ticks=first.ticks,
        host_time=turn[-1].host_time,
        configuration=first.configuration,
        flags=first.flags,
        drops=first.drops,
        samples=np.concatenate([drive.samples for drive in turn]),
        sums=np.concatenate(sums) if sums else None,
    )
