"""What happens to a touch."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from tomoskin.core import Touch

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
        """A sentence for people."""
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
