"""What was lost on the way, over all the times that a source was opened."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Self

from tomoskin.source import Link


@dataclass(frozen=True, slots=True)
class Tally:
    """Counts of what did not arrive.

    ``dropped`` frames that the device or this host left out, ``corrupt`` messages damaged on
    the line, ``gaps`` frames missing in the sequence.
    """

    dropped: int = 0
    corrupt: int = 0
    gaps: int = 0

    @classmethod
    def of(cls, link: Link, device_drops: int) -> Self:
        """Counts of one link; ``device_drops`` is what its last frame said."""
        frames = link.frames
        return cls(device_drops + frames.foreign, link.counters.corrupt, frames.lost)

    def __add__(self, other: Tally) -> Tally:
        """Both together."""
        return Tally(
            self.dropped + other.dropped,
            self.corrupt + other.corrupt,
            self.gaps + other.gaps,
        )
