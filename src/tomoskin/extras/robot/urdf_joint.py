"""The joints of a URDF: how each moves what it holds, and which follow others."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from xml.etree.ElementTree import Element

import numpy as np
from scipy.spatial.transform import Rotation

from tomoskin.core import FloatArray, SkinError, no_such
from tomoskin.extras.robot.link_shapes import name_of, origin_of, part_of
from tomoskin.model.mesh import Pose

STANDS = ("fixed", "")
"""Types of joints that do not move."""

_TURNS, _SLIDES = ("revolute", "continuous"), ("prismatic",)
_UNTOLD = ("floating", "planar")
"""Kinds of joints whose position is not one number, so that no joint state says it."""

_AGREES = 0.05
"""rad or m up to which a reported state may differ from what a joint that it mimics says: play."""

Positions = Callable[[str], float]
"""The position of a joint by its name, rad or m; raises SkinError where it is not known, or as a
dict does KeyError."""


@dataclass(frozen=True, slots=True, eq=False)
class UrdfJoint:
    """What holds the link ``child`` to the link ``parent``.

    Attributes
    ----------
    pose
        Of the child's frame in the parent's, at position zero.
    kind
        The type that the URDF says.
    axis
        (3,) unit vector in the child's frame, about or along which it moves.
    mimics
        A joint that it follows; its position is that of the joint times ``factor``, and ``offset``.
        What gives positions to :meth:`moved` knows that: see :class:`Followed`.
    """

    name: str
    parent: str
    child: str
    pose: Pose
    kind: str = ""
    axis: FloatArray = field(default_factory=lambda: np.array([1.0, 0.0, 0.0]))
    mimics: str = ""
    factor: float = 1.0
    offset: float = 0.0

    def moved(self, positions: Positions) -> Pose:
        """The pose of the child's frame in the parent's. Raises SkinError."""
        if self.kind in STANDS:
            return self.pose
        if self.kind in _UNTOLD:
            raise SkinError(
                f'pose unknown: a joint state has no position of the {self.kind} "{self.name}"'
            )
        way = positions(self.name)
        if self.kind in _SLIDES:
            return self.pose @ Pose(way * self.axis)
        return self.pose @ Pose(rotation=Rotation.from_rotvec(way * self.axis).as_matrix())


@dataclass(frozen=True, slots=True, eq=False)
class Followed:
    """Positions of joints, of which some mimic others.

    Attributes
    ----------
    joints
        By their own names.
    reported
        What joint states say.
    """

    joints: Mapping[str, UrdfJoint]
    reported: Positions

    def __call__(self, name: str) -> float:
        """What the joint that it mimics says by the law of the URDF, over as many joints as that
        takes; else what is reported of itself.

        Raises SkinError where neither is known, and where both are and contradict each other.
        """
        joint = self.joints[name]
        if not joint.mimics:
            return self.reported(name)
        own: float | None = None
        with suppress(SkinError, KeyError):
            own = self.reported(name)
        try:
            by_law = joint.factor * self(joint.mimics) + joint.offset
        except (SkinError, KeyError):
            if own is None:
                raise
            return own
        if own is not None and abs(_apart(joint, own, by_law)) > _AGREES:
            raise SkinError(
                f'pose unknown: the joint "{name}" is reported at {own:.3f}, and mimics '
                f'"{joint.mimics}", which puts it at {by_law:.3f}',
                hint="check <mimic> in the URDF, and which topic its joint states are of",
            )
        return by_law


def _apart(joint: UrdfJoint, one: float, other: float) -> float:
    """Between two positions, the shorter way round where the joint turns on without an end."""
    apart = one - other
    return math.remainder(apart, 2 * math.pi) if joint.kind == "continuous" else apart


def read_joint(element: Element, where: str) -> UrdfJoint:
    """The joint that a <joint> says; what its type does not use is not read. Raises SkinError."""
    name = name_of(element, where)
    ends = [element.find(end) for end in ("parent", "child")]
    parent, child = ("" if end is None else end.get("link", "") for end in ends)
    where = f'{where}: joint "{name}"'
    kind = element.get("type", "")
    known = (*_TURNS, *_SLIDES, *STANDS, *_UNTOLD)
    if kind not in known:
        raise SkinError(no_such(kind, filter(None, known), "a type"), where=where)
    pose = origin_of(element, where)
    if kind not in (*_TURNS, *_SLIDES):
        return UrdfJoint(name, parent, child, pose, kind)
    mimic, axis = element.find("mimic"), np.array(part_of(element, "axis", "xyz", "1 0 0", where))
    if not (length := np.linalg.norm(axis)) > 0:
        raise SkinError("expected an axis with a direction, got 0 0 0", where=where)
    return UrdfJoint(
        name, parent, child, pose, kind, axis / length,
        "" if mimic is None else mimic.get("joint", ""),
        part_of(element, "mimic", "multiplier", "1", where)[0],
        part_of(element, "mimic", "offset", "0", where)[0],
    )  # fmt: skip


def check_mimics(joints: Mapping[str, UrdfJoint], source: str) -> None:
    """Raise SkinError where a joint mimics what is none, or in a ring itself."""
    for joint in joints.values():
        where, last = f'{source}: joint "{joint.name}"', joint
        for _ in joints:
            if not last.mimics:
                break
            if last.mimics not in joints:
                raise SkinError(f'expected a joint to mimic, got "{last.mimics}"', where=where)
            last = joints[last.mimics]
        if last.mimics:
            raise SkinError(
                "expected a joint that does not mimic itself, got a ring of <mimic>", where=where
            )
