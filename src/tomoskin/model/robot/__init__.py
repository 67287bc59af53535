"""Skins on a robot: which there are, and where on its links they lie."""

from tomoskin.model.robot.pose import Place, Pose, pose_numbers, quaternion
from tomoskin.model.robot.robot import FRAME, SECTIONS, PlacedSkin, Robot, add_skin
from tomoskin.model.robot.urdf import LinkSolid, Urdf

__all__ = [
    "FRAME",
    "SECTIONS",
    "LinkSolid",
    "Place",
    "PlacedSkin",
    "Pose",
    "Robot",
    "Urdf",
    "add_skin",
    "pose_numbers",
    "quaternion",
]
