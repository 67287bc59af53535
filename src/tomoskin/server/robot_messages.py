"""The messages to the page of a robot, declared once as those to the page of a skin."""

from __future__ import annotations

from tomoskin.server.page_messages import Flat, Message, MessagePart, Refusal


class DrawnLink(MessagePart, frozen=True):
    """What of a robot's link is drawn: the corners of its triangles, in its frame."""

    link: int
    corners: Flat


class PlacedShape(MessagePart, frozen=True):
    """A skin on a robot: the frame of its touches, and the corners of its triangles in it.

    ``link``: the number of the link whose frame that is; null where it lies on none.
    """

    name: str
    frame: str
    source: str
    link: int | None
    corners: Flat


class RobotScene(Message, frozen=True, tag="robot"):
    """A robot's links and skins.

    ``bones``: numbers of links, two a line; ``links``: those that have a shape; ``undrawn``: which
    have none, and why; ``poses``: of each link in the frame of the root, three rows of four
    numbers: the rotation, and the position in m.
    """

    name: str
    bones: list[int]
    links: list[DrawnLink]
    undrawn: list[str]
    skins: list[PlacedShape]
    poses: Flat
    version: str


class SkinState(MessagePart, frozen=True):
    """How one skin of a robot is doing."""

    running: bool
    ready: bool
    fps: float
    frames: int
    lost: int
    p99_ms: float | None
    problem: str | None
    text: str


class RobotState(Message, frozen=True, tag="robot-state"):
    """How each skin of a robot is doing, and the name of the recording."""

    skins: dict[str, SkinState]
    recording: str | None


class SpaceTouch(MessagePart, frozen=True):
    """A touch where the robot is drawn, in the frame of its root.

    ``force``: N, null where nothing gives it; ``more_than``: N that it is more than, where it is
    beyond what was taught; else null. ``is_self``: whether a link of the robot itself touches;
    null where that is not known.
    """

    id: int
    position: tuple[float, float, float]
    normal: tuple[float, float, float]
    peak: float
    force: float | None
    more_than: float | None = None
    is_self: bool | None = None


class TouchesOfSkin(MessagePart, frozen=True):
    """The touches on one skin, and whether its data can be relied on.

    ``pose_problem``: why it is not known where the link is, so that positions are not either.
    """

    valid: bool
    touches: list[SpaceTouch]
    pose_problem: str | None


class RobotTouches(MessagePart, frozen=True):
    """The newest touches on each skin of a robot; sent as JSON in bytes, the newest only.

    ``poses``: as in the scene, where the links are now.
    """

    skins: dict[str, TouchesOfSkin]
    poses: Flat


ROBOT_MESSAGES = (RobotScene, RobotState, Refusal)
"""What the page of a robot is sent as text."""
