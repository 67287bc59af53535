"""Time as a tracker counts it."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class TrackClock:
    """The moment of a frame.

    Attributes
    ----------
    now
        Seconds since the first frame.
    passed
        Seconds since the frame before.
    host
        The host's, s.
    device
        The device's, s; None before the first frame.
    """

    now: float = 0.0
    passed: float = 0.0
    host: float = 0.0
    device: float | None = None

    def at(self, device: float, host: float) -> TrackClock:
        """The moment of the next frame: where the device's time does not go on, as when a board
        starts again, the host's counts."""
        passed = 0.0
        if self.device is not None:
            passed = device - self.device if device > self.device else max(host - self.host, 0.0)
        return TrackClock(self.now + passed, passed, host, device)
