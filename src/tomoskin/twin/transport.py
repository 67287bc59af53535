"""The twin as a transport: paced by a clock, computed when it is read."""

from __future__ import annotations

import threading
import time
from typing import Protocol

from tomoskin.core import SourceError
from tomoskin.twin.device import TwinDevice
from tomoskin.twin.press import Press
from tomoskin.twin.sheet import TwinSkin


class Clock(Protocol):
    """Where the twin takes its time from."""

    def now(self) -> float:
        """Monotonic seconds."""

    def wait(self, condition: threading.Condition, seconds: float) -> None:
        """Wait for ``condition`` (held) at most that long."""


class WallClock:
    """The computer's own time."""

    def now(self) -> float:
        """Monotonic seconds."""
        return time.monotonic()

    def wait(self, condition: threading.Condition, seconds: float) -> None:
        """Wait for ``condition`` (held) at most that long."""
        condition.wait(seconds)


class TwinTransport:
    """Bytes of a twin, in real time.

    One thread reads; ``write``, ``set_presses`` and ``close`` may come from any.
    """

    def __init__(self, skin: TwinSkin, device: TwinDevice, clock: Clock) -> None:
        """``device`` must have been powered on by the same ``clock``."""
        self.name = "twin"
        self.device = device
        self._skin = skin
        self._clock = clock
        self._condition = threading.Condition()
        self._inbox = bytearray()
        self._closed = False

    @property
    def presses(self) -> tuple[Press, ...]:
        """What presses on the twin now."""
        return self._skin.presses

    def set_presses(self, presses: tuple[Press, ...]) -> None:
        """Replace all presses; they show from the next frame on.

        Raises
        ------
        GeometryError
            When the centre of one is off the skin; then nothing is changed.
        """
        self._skin.set_presses(presses)

    def read(self, timeout: float) -> bytes:
        """What the twin sends next, waiting at most ``timeout`` s; ``b""`` if nothing."""
        end = self._clock.now() + timeout
        while True:
            received = self._take()
            now = self._clock.now()
            if received:
                self.device.receive(received, now)
            data = self.device.emit(now)
            if data or now >= end:
                return data
            with self._condition:
                if not self._inbox and not self._closed:
                    self._clock.wait(self._condition, max(min(self.device.due, end) - now, 0.0))

    def write(self, data: bytes) -> None:
        """Send ``data`` to the twin."""
        with self._condition:
            self._check_open()
            self._inbox += data
            self._condition.notify()

    def close(self) -> None:
        """Switch the twin off."""
        with self._condition:
            self._closed = True
            self._condition.notify()

    def _take(self) -> bytes:
        with self._condition:
            self._check_open()
            data = bytes(self._inbox)
            self._inbox.clear()
        return data

    def _check_open(self) -> None:
        if self._closed:
            raise SourceError("the twin has been switched off", where=self.name)
