"""Skins on a robot: on the links of a URDF, all in one program, one recording and one page."""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from tomoskin.extras.robot.moving_link import (
        MovingLink as MovingLink,
        PlaceOnRobot as PlaceOnRobot,
    )
    from tomoskin.extras.robot.robot_file import (
        SECTIONS as SECTIONS,
        PlacedSkin as PlacedSkin,
        Robot as Robot,
        add_skin as add_skin,
    )
    from tomoskin.extras.robot.robot_run import (
        Member as Member,
        RobotRun as RobotRun,
        open_robot as open_robot,
        with_joints as with_joints,
    )
    from tomoskin.extras.robot.self_contact import NearLink as NearLink
    from tomoskin.extras.robot.urdf import Urdf as Urdf

_HOME = {
    "Member": "robot_run",
    "MovingLink": "moving_link",
    "NearLink": "self_contact",
    "PlaceOnRobot": "moving_link",
    "PlacedSkin": "robot_file",
    "Robot": "robot_file",
    "RobotRun": "robot_run",
    "SECTIONS": "robot_file",
    "Urdf": "urdf",
    "add_skin": "robot_file",
    "open_robot": "robot_run",
    "with_joints": "robot_run",
}
"""Where each name lives; it is imported when it is first asked for, so that options cost little."""


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"{__name__}.{_HOME[name]}"), name)
