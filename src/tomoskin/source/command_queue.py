"""Commands to a board, one after another: each has an id, and is repeated until it is answered."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable
from dataclasses import dataclass, replace

from tomoskin.core import SourceError
from tomoskin.source.settings import Timing
from tomoskin.wire import Command, SetBaud, encode


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
        """Nothing to be sent."""
        self.last_sent = now
        self._timing, self._where = timing, where
        self._waiting: deque[Command] = deque()
        self._pending: _Pending | None = None
        self._request = 0
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

    def repeat(self, now: float) -> None:
        """Send the pending command again, when it is time; SourceError after too many tries."""
        pending = self._pending
        if pending is None or now < pending.sent + self._timing.answer:
            return
        if pending.tries >= self._timing.tries:
            raise SourceError(
                f"no answer to {type(pending.command).__name__} after {pending.tries} tries",
                where=self._where,
                hint="is it a tomoskin board, powered, at this rate?",
            )
        if isinstance(pending.command, SetBaud):  # it may have gone back: do it again
            pending.command = self._numbered(pending.command)
        pending.tries += 1
        pending.sent = now
        self._send(pending.command, now)

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
