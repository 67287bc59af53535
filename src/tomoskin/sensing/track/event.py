"""When a frame is, and what happens to a touch in it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from tomoskin.core import Touch


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


Happening = Literal["onset", "move", "release", "merge", "split"]


@dataclass(frozen=True, slots=True, eq=False)
class TouchEvent:
    """One thing that happened to one touch.

    Attributes
    ----------
    kind
        "onset"; "move", by more than noise since the last event; "release"; "merge", where it
        can no longer be separated from others; "split", where it can again.
    touch
        As it is after it; at a release, as it was last.
    host_time
        Of the frame in which it was noticed, host monotonic s.
    """

    kind: Happening
    touch: Touch
    host_time: float

    @property
    def text(self) -> str:
        """The event in a sentence for people."""
        r = self.touch.detection
        position = f"{1e3 * r.x:.0f}, {1e3 * r.y:.0f} mm"
        others = [str(number) for number in self.touch.merged if number != self.touch.id]
        return (
            f"touch {self.touch.id}: "
            + {
                "onset": f"begins at {position}",
                "move": f"is at {position}",
                "release": f"ends at {position}",
                "merge": f"and {' and '.join(others)} are too close to separate, at {position}",
                "split": f"is apart again, at {position}",
            }[self.kind]
        )
