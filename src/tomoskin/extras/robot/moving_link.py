"""Where a skin lies on a robot, where its link was, and which touches are the robot's own."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property, lru_cache, partial
from typing import Any, Self, TypeVar

from tomoskin.core import FloatArray, SkinError, Touch
from tomoskin.extras.robot.self_contact import LINGERS, NearLink, OwnLinks
from tomoskin.extras.robot.urdf_joint import Positions
from tomoskin.files.messages import LinkPose, Place
from tomoskin.model.mesh import Pose

T = TypeVar("T")
_Near = tuple[NearLink | None, str | None]

JointPositions = Callable[[float], Positions]
"""How a robot stands at a time, s since 1970."""


@dataclass(frozen=True, eq=False)
class MovingLink:
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
        Looks at where the other links were: see :meth:`PlaceOnRobot.near`.
    """

    root: str
    pose: Pose | None
    problem: str | None = None
    near: Callable[[], _Near] = field(default=lambda: (None, None), repr=False)
    _marks: dict[Touch, bool | None] = field(default_factory=dict, init=False, repr=False)

    @classmethod
    @lru_cache(maxsize=64)
    def of(cls, place: PlaceOnRobot, utc: float | None) -> Self | None:
        """At a time, s since 1970; None of a skin that lies on no link.

        All sinks of a frame are given the same record, so that each thing is looked up once.
        """
        if place.own is None:
            return None
        pose, problem = _or_why(place.in_root, utc)
        return cls(place.own.urdf.root, pose, problem, partial(_or_why, place.near, utc))

    @cached_property
    def others(self) -> _Near:
        """What tells whether another link was near; None where it is not known, and why."""
        return self.near()

    @property
    def self_problem(self) -> str | None:
        """Why it is not known which touches are the robot's own, or None."""
        return self.others[1]

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


@dataclass(frozen=True, slots=True)
class PlaceOnRobot(Place):
    """Where a skin lies on a robot whose links move.

    ``own`` are the links of the robot that can touch the skin, and ``joints`` says how it stands.
    """

    own: OwnLinks | None = None
    joints: JointPositions | None = None

    @property
    def leaves_out(self) -> bool:
        """Whether touches by the robot's own links are left out of messages."""
        return self.own is not None and self.own.leaves_out

    def at(self, utc: float | None) -> LinkPose | None:
        """Where the link was at a time, s since 1970; None where there is no link."""
        return MovingLink.of(self, utc)

    def in_root(self, utc: float | None) -> Pose | None:
        """The pose of the link in the robot's root frame at a time, s since 1970.

        None where there is no link. Raises SkinError where the pose is not known.
        """
        return self.own.urdf.pose(self.link, self._positions(utc)) if self.own else None

    @property
    def unmarked(self) -> str:
        """Which touches by the robot's own links cannot be told from others, and why; else ""."""
        if self.own is None or not self.own.others:
            return ""
        why = "no joint states are given" if self.joints is None else self.own.problem
        return why and f"touches by the robot's own links are not marked: {why}"

    def near(self, utc: float | None) -> NearLink | None:
        """What tells of points whether another link of the robot was near, then or just before.

        None where there is no link. Raises SkinError where the pose of one is not known.
        """
        stances = [self._positions(utc and utc - ago) for ago in (0.0, LINGERS)]
        return self.own.at(*stances) if self.own else None

    def _positions(self, utc: float | None) -> Positions:
        return _not_told if self.joints is None or utc is None else self.joints(utc)


def _not_told(joint: str) -> float:
    raise SkinError(
        f'pose unknown: the joint "{joint}" may move, and no joint states are given',
        hint='name its joint states in the section [robot], as in joints = "ros2"',
    )
