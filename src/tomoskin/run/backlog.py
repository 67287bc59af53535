"""What is left out where a host does not keep up: the oldest frames, until it is behind by none."""

from __future__ import annotations

MOST_AT_ONCE = 16
"""Frames of one read that are computed at most: a late picture helps nobody."""

_PROMPT = 1e-3
"""s that a read's first byte has waited at most where the host keeps up."""

_CALM = 100
"""Prompt reads in a row after which more frames are computed at once again."""


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
