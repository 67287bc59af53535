"""Skins on a robot: which there are, and where on its links they lie."""

from tomoskin.model.robot.pose import Moved, Place, Pose, pose_numbers, quaternion
from tomoskin.model.robot.robot import FORMAT, SECTIONS, PlacedSkin, Robot, add_skin
from tomoskin.model.robot.urdf import LinkSolid, Urdf

__all__ = [
    "FORMAT",
    "SECTIONS",
    "LinkSolid",
    "Moved",
    "Place",
    "PlacedSkin",
    "Pose",
    "Robot",
    "Urdf",
    "add_skin",
    "pose_numbers",
    "quaternion",
]
