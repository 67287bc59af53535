"""Where the link of a robot was that a skin lies on, and which touches are the robot's own."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property, lru_cache, partial
from typing import Any, Self, TypeVar

from tomoskin.core import FloatArray, SkinError, Touch
from tomoskin.model.robot import NearLink, Place, Pose

T = TypeVar("T")
_Near = tuple[NearLink | None, str | None]


@dataclass(frozen=True, eq=False)
class LinkPose:
    """Where the link of a robot that a skin lies on was at some time, and what was near it.

    Attributes
    ----------
    root
        Name of the robot's root frame.
    pose
        Of the link in that frame; None where it is not known.
    problem
        Why it is not known, or None.
    near
        Looks at where the other links were: see :meth:`~tomoskin.model.robot.Place.near`.
    """

    root: str
    pose: Pose | None
    problem: str | None = None
    near: Callable[[], _Near] = field(default=lambda: (None, None), repr=False)
    _marks: dict[Touch, bool | None] = field(default_factory=dict, init=False, repr=False)

    @classmethod
    @lru_cache(maxsize=64)
    def of(cls, place: Place | None, utc: float | None) -> Self | None:
        """At a time, s since 1970; None of a skin that lies on no link.

        All sinks of a frame are given the same record, so that each thing is looked up once.
        """
        if place is None or place.own is None:
            return None
        pose, problem = _or_why(place.in_root, utc)
        return cls(place.own.urdf.root, pose, problem, partial(_or_why, place.near, utc))

    @cached_property
    def others(self) -> _Near:
        """What tells whether another link was near; None where it is not known, and why."""
        return self.near()

    def mark(self, touch: Touch, ellipse: Callable[[], FloatArray]) -> bool | None:
        """Whether another link was near a third of the ``ellipse`` of ``touch`` or more.

        None where that is not known. A link that is so near presses as a rule, so a third will do.
        """
        if touch not in self._marks:
            near = self.others[0]
            self._marks[touch] = near and bool(3 * near(points := ellipse()).sum() >= len(points))
        return self._marks[touch]

    def content(self) -> dict[str, Any]:
        """The pose and what is wrong with it, as plain values by name."""
        pose = self.pose and {
            "frame_id": self.root,
            "position": self.pose.position.tolist(),
            "orientation": self.pose.quaternion(),
        }
        return {"root": pose, "root_problem": self.problem}


def _or_why(of: Callable[[float | None], T], utc: float | None) -> tuple[T | None, str | None]:
    """What was ``of`` that time; None where it is not known, and why."""
    try:
        return of(utc), None
    except SkinError as error:
        return None, str(error)
