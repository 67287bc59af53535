"""Skins on a robot: which there are, and where on its links they lie."""

from tomoskin.model.robot.link_shapes import (
    Pose as Pose,
    pose_numbers as pose_numbers,
    quaternion as quaternion,
)
from tomoskin.model.robot.robot import (
    FRAME as FRAME,
    SECTIONS as SECTIONS,
    Place as Place,
    PlacedSkin as PlacedSkin,
    Robot as Robot,
    add_skin as add_skin,
)
from tomoskin.model.robot.self_contact import NearLink as NearLink
from tomoskin.model.robot.urdf import Urdf as Urdf
