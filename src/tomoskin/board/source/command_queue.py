"""Commands to a board, and frames from it, in order."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable
from dataclasses import dataclass, replace

from tomoskin.board.source.settings import Configuration, Timing
from tomoskin.board.wire import Command, FrameFlag, Ping, SetBaud, encode
from tomoskin.core import DriveSamples, Event, Frame, SourceError

_MODULUS = 2**32
_LATE = "the board read some samples later than planned, since an interrupt came late"
_DEAF = "the board has lost bytes that this computer sent"
_ANY = -1
"""The expected number of a frame that may have any."""


@dataclass(slots=True)
class FrameCounters:
    """Frames since the link was made, until now.

    ``passed`` on; ``lost`` by their sequence numbers; ``foreign``: another configuration or a
    wrong number of samples; ``stale``: behind the sequence, or before START was answered. Drives
    that come singly count as foreign or stale in the same way; a turn that lacks one is lost.
    ``late``, ``deaf``: frames that say that the board read late, or lost bytes of this host.
    """

    passed: int = 0
    lost: int = 0
    foreign: int = 0
    stale: int = 0
    late: int = 0
    deaf: int = 0


class SequenceFilter:
    """Checks each frame against the configuration and the sequence, and counts it."""

    def __init__(self, configuration: Configuration) -> None:
        """Make a filter that waits for the first frame."""
        self._configuration = configuration
        self._expected: int | None = None
        self._foreign_run = False
        self.counters = FrameCounters()

    def open(self) -> None:
        """START has been answered: the sequence begins at 0."""
        self._expected = 0

    def expect_any(self) -> None:
        """The next frame may have any number: what it comes from has been set to another place."""
        if self._expected is not None:
            self._expected = _ANY

    def close(self) -> None:
        """No frame passes until START is answered again."""
        self._expected = None

    def take(self, frame: Frame) -> list[Frame | Event]:
        """The frame, or nothing; and an event if frames are missing or foreign ones begin."""
        if (refusal := self.refuse(frame)) is not None:
            return [*refusal]
        gap = self._gap(frame)
        if gap >= _MODULUS // 2:
            self.counters.stale += 1
            return []
        self.counters.passed += 1
        return [*self._go_on(frame, gap), *self._losses(frame), frame]

    def reach(self, drive: DriveSamples) -> list[Event]:
        """A turn begins with ``drive``, which is still to make its frame; what is missing."""
        gap = self._gap(drive)
        if gap >= _MODULUS // 2:
            return []
        events = self._go_on(drive, gap)
        self._expected = drive.sequence
        return events

    def refuse(self, item: Frame | DriveSamples) -> list[Event] | None:
        """None for what is of this scan; all else is counted, and an event says when it begins."""
        if self._expected is None:
            self.counters.stale += 1
            return []
        fault = self._fault(item)
        if not fault:
            self._foreign_run = False
            return None
        self.counters.foreign += 1
        first, self._foreign_run = not self._foreign_run, True
        return [Event(item.host_time, "foreign", fault)] if first else []

    def _gap(self, item: Frame | DriveSamples) -> int:
        """How many turns are missing before this one; half the modulus or more: it is old."""
        assert self._expected is not None
        return 0 if self._expected == _ANY else (item.sequence - self._expected) % _MODULUS

    def _losses(self, frame: Frame) -> list[Event]:
        """What the board says in ``frame`` that it has lost."""
        events = []
        if frame.flags & FrameFlag.LATE:
            self.counters.late += 1
            events.append(Event(frame.host_time, "late", _LATE))
        if frame.flags & FrameFlag.DEAF:
            self.counters.deaf += 1
            events.append(Event(frame.host_time, "deaf", _DEAF))
        return events

    def _go_on(self, item: Frame | DriveSamples, lost: int) -> list[Event]:
        self._expected = (item.sequence + 1) % _MODULUS
        if lost <= 0:
            return []
        self.counters.lost += lost
        text = f"{lost} frame{'s' if lost > 1 else ''} lost before frame {item.sequence}"
        return [Event(item.host_time, "lost", text)]

    def _fault(self, item: Frame | DriveSamples) -> str:
        scan, n = self._configuration, len(item.samples)
        if item.configuration != scan.identity:
            return (
                f"frames of configuration {item.configuration:04x} are left out: this scan has "
                f"configuration {scan.identity:04x}"
            )
        if isinstance(item, Frame):
            expected, what = scan.n_samples, f"frames with {n} samples"
        else:
            possible = item.order == 0 and item.drive == item.place < len(scan.channels)
            expected = scan.channels[item.drive] if possible else -1
            what = f"messages of drive {item.drive} with {n} samples"
        text = f"{what} are left out: this scan has {scan.n_samples} samples"
        return "" if n == expected else text


@dataclass
class _Pending:
    command: Command
    sent: float
    tries: int


class CommandQueue:
    """Commands that wait, the one that is pending, and the bytes to be sent. No I/O.

    Attributes
    ----------
    last_sent
        When anything was sent last, s.
    """

    def __init__(self, timing: Timing, now: float, where: str) -> None:
        """Make a queue without commands."""
        self.last_sent = now
        self._timing, self._where = timing, where
        self._waiting: deque[Command] = deque()
        self._pending: _Pending | None = None
        self._request = 0
        self._rate: int | None = None
        self._out = bytearray()

    @property
    def pending(self) -> Command | None:
        """The command that an answer is awaited to."""
        return self._pending.command if self._pending else None

    @property
    def repeat_time(self) -> float | None:
        """When the pending command is repeated; None where there is none."""
        return self._pending.sent + self._timing.answer if self._pending else None

    def restart(self, commands: Iterable[Command], now: float) -> None:
        """Send these, whatever else was to be sent."""
        self._waiting = deque(commands)
        self.send_next(now)

    def add(self, commands: Iterable[Command]) -> None:
        """Send these after those that wait."""
        self._waiting.extend(commands)

    def clear(self) -> None:
        """Await nothing and send nothing more."""
        self._waiting.clear()
        self._pending = None

    def send_next(self, now: float) -> bool:
        """Send the next command, since the pending one is answered; False where none waits."""
        if isinstance(self.pending, SetBaud):
            self._rate = self.pending.baud
        self._pending = None
        if not self._waiting:
            return False
        command = self._numbered(self._waiting.popleft())
        self._pending = _Pending(command, now, 1)
        self._send(command, now)
        return True

    def send(self, command: Command, now: float) -> int:
        """Send a command that no answer is awaited to; its request id."""
        numbered = self._numbered(command)
        self._send(numbered, now)
        return numbered.request

    def keep_alive(self, now: float) -> None:
        """Let a board that scans know that the host is there, where it is time to."""
        if now >= self.last_sent + self._timing.ping:
            self.send(Ping(0), now)

    def repeat(self, now: float) -> None:
        """Send the pending command again, when it is time; SourceError after too many tries."""
        pending = self._pending
        if pending is None or now < pending.sent + self._timing.answer:
            return
        if pending.tries >= self._timing.tries:
            raise SourceError(
                f"no answer to {type(pending.command).__name__} after {pending.tries} tries",
                where=self._where,
                hint="check that it is a tomoskin board, that it has power, and that the rate is "
                "right",
            )
        if isinstance(pending.command, SetBaud):  # it may have gone back: do it again
            pending.command = self._numbered(pending.command)
        pending.tries += 1
        pending.sent = now
        self._send(pending.command, now)

    def take_rate(self) -> int | None:
        """The serial rate that the board has just changed to, Bd, once."""
        rate, self._rate = self._rate, None
        return rate

    def take(self) -> bytes:
        """Bytes to be sent to the board, once."""
        data = bytes(self._out)
        self._out.clear()
        return data

    def _numbered(self, command: Command) -> Command:
        self._request = self._request % 255 + 1
        return replace(command, request=self._request)

    def _send(self, command: Command, now: float) -> None:
        self.last_sent = now
        self._out += encode(command)
