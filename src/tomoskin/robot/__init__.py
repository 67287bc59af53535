"""Skins on a robot: which there are, and where on its links they lie."""

from tomoskin.robot.pose import Moved, Place, Pose
from tomoskin.robot.robot import FORMAT, PlacedSkin, Robot, RobotSection, SkinSection, add_skin
from tomoskin.robot.urdf import Urdf

__all__ = [
    "FORMAT",
    "Moved",
    "Place",
    "PlacedSkin",
    "Pose",
    "Robot",
    "RobotSection",
    "SkinSection",
    "Urdf",
    "add_skin",
]
