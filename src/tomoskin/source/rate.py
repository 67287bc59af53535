"""The serial rate: a slower one where the line damages what it carries."""

from __future__ import annotations

from typing import Protocol, runtime_checkable

from tomoskin.wire import Counters

RATES = (1_000_000, 500_000, 250_000)
"""Rates that the ATmega's clock divides into exactly, fastest first, Bd."""

_WINDOW = 50
"""Messages that are looked at together."""

_DAMAGED = 5
"""So many of them damaged, and the line is too fast: by chance in one window of 10⁵ at 1 %."""


@runtime_checkable
class Rated(Protocol):
    """A transport whose rate can be changed while it is open."""

    @property
    def rate(self) -> int:
        """Bd."""

    def use_rate(self, rate: int) -> None:
        """Send and read at ``rate`` Bd from now on; SourceError when the device has gone away."""


class LineQuality:
    """Watches what share of the messages arrives damaged."""

    def __init__(self) -> None:
        """A line that has carried nothing yet."""
        self._messages = self._corrupt = 0

    def slower(self, counters: Counters, rate: int) -> int | None:
        """The rate to fall back to from ``rate``, where this one damages too much; else None."""
        corrupt = counters.corrupt - self._corrupt
        came = counters.messages - self._messages + corrupt
        if came < _WINDOW and corrupt < _DAMAGED:
            return None
        self.forget(counters)
        if corrupt < _DAMAGED:
            return None
        return next((slower for slower in RATES if slower < rate), None)

    def forget(self, counters: Counters) -> None:
        """Begin a new window."""
        self._messages, self._corrupt = counters.messages, counters.corrupt
