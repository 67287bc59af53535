"""How a page's bends and stretches deform the twin's sheet, and how a recording describes them."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from tomoskin.core import WireError
from tomoskin.mesh import Arm, Hinge, Plane, Surface
from tomoskin.run.twin_requests import BendRequest, SetPose
from tomoskin.twin import Bent, Pose, Stretched


@dataclass(frozen=True, slots=True)
class SheetPose:
    """A deformed sheet: its ``pose``, what was ``asked``, and the ``truth`` for a recording."""

    pose: Pose = ()
    asked: SetPose = field(default_factory=SetPose)
    truth: tuple[dict[str, Any], ...] = ()


def way_to_bend(rest: Surface) -> str | None:
    """How a sheet that lies on ``rest`` can be bent: "hinge", "joint", or not at all."""
    if isinstance(rest, Plane):
        return "hinge"
    return "joint" if isinstance(rest, Arm) else None


def sheet_pose(asked: SetPose, rest: Surface) -> SheetPose:
    """The deformation of a sheet that lies on ``rest``.

    Raises
    ------
    WireError
        Where such a sheet cannot be bent.
    GeometryError
        Where it cannot take that shape.
    """
    pose: Pose = ()
    truth: list[dict[str, Any]] = []
    if (bend := asked.bend) is not None:
        kind = way_to_bend(rest)
        pose += (Bent(_surface(bend, rest)),)
        axis = bend.axis if kind == "hinge" else 0.0
        truth.append({"kind": kind, "angle": bend.angle, "axis": axis})
    if (stretch := asked.stretch) is not None:
        pose += (Stretched(stretch.along, stretch.across, stretch.axis),)
        truth.append({"kind": "stretch", "strain": stretch.along, "axis": stretch.axis})
    return SheetPose(pose, asked, tuple(truth))


def _surface(bend: BendRequest, rest: Surface) -> Surface:
    if isinstance(rest, Plane):
        return Hinge(bend.angle, bend.length, bend.axis, bend.offset)
    if isinstance(rest, Arm):
        return Arm(rest.radius, rest.angle + bend.angle, rest.joint)
    raise WireError(
        "only a sheet that lies flat or on a limb with a joint can be bent from here; this one can "
        "be stretched"
    )
