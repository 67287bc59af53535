"""Skins on a robot: which there are, and where on its links they lie."""

from tomoskin.model.robot.pose import Pose, pose_numbers, quaternion
from tomoskin.model.robot.robot import (
    FRAME,
    SECTIONS,
    Place,
    PlacedSkin,
    Robot,
    add_skin,
)
from tomoskin.model.robot.urdf import Urdf

__all__ = [
    "FRAME",
    "SECTIONS",
    "Place",
    "PlacedSkin",
    "Pose",
    "Robot",
    "Urdf",
    "add_skin",
    "pose_numbers",
    "quaternion",
]
