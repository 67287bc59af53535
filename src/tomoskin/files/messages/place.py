"""Where a skin lies, as far as what leaves the program says it."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, Protocol

from tomoskin.core import FloatArray, Touch
from tomoskin.model.mesh import Moved, Pose, Surface

FRAME = re.compile(r"[\w.-]+(/[\w.-]+)*", re.ASCII)
"""What names a frame of coordinates: that which every program of ROS takes."""


class LinkPose(Protocol):
    """Where the link that a skin lies on was at some time, and whether another one touched it."""

    @property
    def pose(self) -> Pose | None:
        """Of the link in the root frame; None where it is not known."""

    @property
    def problem(self) -> str | None:
        """Why it is not known, or None."""

    @property
    def self_problem(self) -> str | None:
        """Why it is not known whether another link touched the skin, or None."""

    def mark(self, touch: Touch, ellipse: Callable[[], FloatArray]) -> bool | None:
        """Whether another link touched there; None where that is not known.

        ``ellipse`` gives points (n, 3) m that stand for where ``touch`` may be.
        """

    def content(self) -> dict[str, Any]:
        """The pose and what is wrong with it, as plain values by name."""


@dataclass(frozen=True, slots=True)
class Place:
    """Which of several skins it is, and where: ``pose`` in the frame ``link``.

    ``link`` is "" where it is not known: coordinates are then the skin's own.
    """

    name: str
    link: str = ""
    pose: Pose = field(default_factory=Pose)

    @property
    def leaves_out(self) -> bool:
        """Whether touches by other links of its own are left out of messages."""
        return False

    def moved(self, surface: Surface) -> Surface:
        """The skin's ``surface`` in the coordinates of the link."""
        return Moved(surface, self.pose) if self.link else surface

    def at(self, utc: float | None) -> LinkPose | None:
        """Where the link was at a time, s since 1970; None where nothing tells that links move."""
        del utc
        return None
