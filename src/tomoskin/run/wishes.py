"""What is to become of the next frame: as a person wishes, or as it was when it was recorded."""

from __future__ import annotations

from pathlib import Path
from typing import Protocol, runtime_checkable

from tomoskin.core import Frame
from tomoskin.recording import Mark
from tomoskin.source import Transport


@runtime_checkable
class Replayed(Protocol):
    """A source that plays a recording and knows what became of each of its frames."""

    path: Path
    """The recording."""

    start: float
    """Host time of its first frame, those from before the recording left out."""

    end: float
    """Host time of its last message."""

    speed: float
    """Recorded seconds per second; inf for as fast as it is read."""

    touches_before: int
    """The last identity that a touch had before it begins."""

    loop: bool
    """Whether it begins again at the end."""

    ended: bool
    """Whether nothing is left to play."""

    @property
    def paused(self) -> bool:
        """Whether it stands still."""

    def now(self) -> float:
        """The time in the recording, host monotonic s."""

    def seek(self, host_time: float) -> None:
        """Go on from the first frame at ``host_time``."""

    def step(self) -> None:
        """Play one read and stand still."""

    def mark(self, sequence: int) -> Mark | None:
        """What became of a frame that was just read; None: it never reached the pipeline."""

    def pause(self, on: bool) -> None:
        """Stand still, or go on."""


class Wishes:
    """What a person asks of the pipeline between two frames; set from any thread."""

    def __init__(self) -> None:
        """No wish but a reference from the first frame on."""
        self._reference = True
        self._held = False
        self._opened = False
        self._replayed: Replayed | None = None

    @property
    def replay(self) -> Replayed | None:
        """The recording that is being played, or None."""
        return self._replayed

    @property
    def held(self) -> bool:
        """Whether the picture is to be held, or the replay stands still."""
        return self._replayed.paused if self._replayed else self._held

    def hold(self, on: bool) -> None:
        """Hold the picture, or let it go on; a replay stands still instead."""
        if self._replayed:
            self._replayed.pause(on)
        else:
            self._held = on

    def take_reference(self) -> None:
        """The next frame begins a reference."""
        self._reference = True

    def opened(self, transport: Transport) -> None:
        """A source has been opened; what comes from now on is its."""
        self._opened = True
        self._replayed = transport if isinstance(transport, Replayed) else None

    def mark(self, frame: Frame, *, late: bool) -> Mark | None:
        """What becomes of ``frame``; ``late``: newer ones wait already. None: leave it out."""
        known: Mark | None = Mark.NONE
        if self._replayed:
            known = self._replayed.mark(frame.sequence)
        elif late:
            known = Mark.SKIPPED
        elif self._held:
            known = Mark.HELD
        if known is None:
            return None
        if self._opened:
            self._opened = False
            known |= Mark.OPENED
        if self._reference and not known & Mark.SKIPPED:
            self._reference = False
            known |= Mark.REFERENCE
        return known
