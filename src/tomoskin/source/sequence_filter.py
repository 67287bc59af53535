"""Only frames of this scan, in order, pass; what is missing or foreign is counted and reported."""

from __future__ import annotations

from dataclasses import dataclass

from tomoskin.core import Event, Frame
from tomoskin.source.configuration import Configuration

_MODULUS = 2**32
_ANY = -1
"""The expected number of a frame that may have any."""


@dataclass(frozen=True, slots=True)
class FrameCounters:
    """Frames since the link was made.

    ``passed`` on; ``lost`` by their sequence numbers; ``foreign``: another configuration or a
    wrong number of samples; ``stale``: behind the sequence, or before START was answered.
    """

    passed: int = 0
    lost: int = 0
    foreign: int = 0
    stale: int = 0


class SequenceFilter:
    """Checks each frame against the configuration and the sequence."""

    def __init__(self, configuration: Configuration) -> None:
        """No frame passes yet."""
        self._configuration = configuration
        self._expected: int | None = None
        self._foreign_run = False
        self._passed = self._lost = self._foreign = self._stale = 0

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

    @property
    def counters(self) -> FrameCounters:
        """Counts so far."""
        return FrameCounters(self._passed, self._lost, self._foreign, self._stale)

    def take(self, frame: Frame) -> list[Frame | Event]:
        """The frame, or nothing; and an event if frames are missing or foreign ones begin."""
        if self._expected is None:
            self._stale += 1
            return []
        fault = self._fault(frame)
        if fault:
            self._foreign += 1
            first, self._foreign_run = not self._foreign_run, True
            return [Event(frame.host_time, "foreign", fault)] if first else []
        self._foreign_run = False
        gap = 0 if self._expected == _ANY else (frame.sequence - self._expected) % _MODULUS
        if gap >= _MODULUS // 2:
            self._stale += 1
            return []
        self._expected = (frame.sequence + 1) % _MODULUS
        self._passed += 1
        if not gap:
            return [frame]
        self._lost += gap
        text = f"{gap} frame{'s' if gap > 1 else ''} lost before frame {frame.sequence}"
        return [Event(frame.host_time, "lost", text), frame]

    def _fault(self, frame: Frame) -> str:
        wanted = self._configuration
        if frame.configuration != wanted.identity:
            return (
                f"frames of configuration {frame.configuration:04x} are left out: "
                f"this scan is {wanted.identity:04x}"
            )
        if len(frame.samples) != wanted.n_samples:
            return (
                f"frames with {len(frame.samples)} samples are left out: "
                f"this scan has {wanted.n_samples}"
            )
        return ""
