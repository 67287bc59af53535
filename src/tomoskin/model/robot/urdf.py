"""A robot's links and joints, from a URDF."""

from __future__ import annotations

from collections.abc import Container
from dataclasses import dataclass
from difflib import get_close_matches
from pathlib import Path
from typing import Self
from xml.etree import ElementTree

import numpy as np

from tomoskin.core import FloatArray, GeometryError, SkinError, StrPath
from tomoskin.model.robot.link_shapes import (
    MOST_TRIANGLES,
    LinkShape,
    name_of,
    origin_of,
    read_shapes,
    thinned,
)
from tomoskin.model.robot.pose import Pose
from tomoskin.model.skin import read_text

_LARGEST = 20_000_000
"""A URDF has at most so many bytes."""


@dataclass(frozen=True, slots=True, eq=False)
class UrdfJoint:
    """What holds the link ``child`` to the link ``parent``: its frame's pose there, at rest."""

    name: str
    parent: str
    child: str
    pose: Pose


@dataclass(frozen=True, slots=True, eq=False)
class LinkSolid:
    """What of a ``link`` can be drawn: ``triangles`` (n, 3, 3) m in its frame; why not the rest."""

    link: str
    triangles: FloatArray
    problems: tuple[str, ...]


@dataclass(frozen=True, slots=True, eq=False)
class Urdf:
    """A tree of links.

    Attributes
    ----------
    source
        The file.
    name
        Of the robot.
    links
        Names, in the order of the file.
    joints
        By the name of the link that each holds.
    shapes
        Of all links, visual ones before those for collisions.
    """

    source: str
    name: str
    links: tuple[str, ...]
    joints: dict[str, UrdfJoint]
    shapes: tuple[LinkShape, ...]

    @classmethod
    def read(cls, path: StrPath) -> Self:
        """From a file.

        Raises
        ------
        SkinError
            When it cannot be read, is no URDF, or its links are no tree.
        """
        path = Path(path)
        text = read_text(path, "a URDF", _LARGEST)
        where = str(path)
        if "<!ENTITY" in text:
            raise SkinError(
                "declares XML entities, which a URDF does not need",
                where=where,
                hint="remove <!ENTITY …>",
            )
        try:
            root = ElementTree.fromstring(text)
        except ElementTree.ParseError as error:
            raise SkinError(
                f"is not valid XML, so it is not a URDF: {error}", where=where
            ) from None
        macro = next((e.tag for e in root.iter() if "xacro}" in e.tag), "")
        if root.tag != "robot" or macro or "${" in text:
            raise SkinError(
                "expected <robot> with its links, got "
                + (f"<{root.tag}>" if root.tag != "robot" else "a xacro with macros"),
                where=where,
                hint="expand xacro first: xacro ROBOT.xacro > ROBOT.urdf",
            )
        links = tuple(name_of(link, where) for link in root.findall("link"))
        joints = [_joint(joint, where) for joint in root.findall("joint")]
        shapes = tuple(read_shapes(root, path))
        urdf = cls(where, root.get("name", ""), links, {j.child: j for j in joints}, shapes)
        urdf._check(joints)
        return urdf

    def check_link(self, link: str, where: str) -> None:
        """Raise SkinError where there is no such link, with the one that may have been meant."""
        if link not in self.links:
            close = get_close_matches(link, self.links, n=1)
            known = ", ".join(self.links[:20])
            raise SkinError(
                f'there is no link "{link}" in {self.source}',
                where=where,
                hint=f'did you mean "{close[0]}"?' if close else f"its links: {known}",
            )

    def pose(self, link: str) -> Pose:
        """Of a link's frame in that of the root, every joint at zero."""
        pose = Pose()
        while (joint := self.joints.get(link)) is not None:
            pose, link = joint.pose @ pose, joint.parent
        return pose

    @property
    def meshes(self) -> dict[str, Pose]:
        """Pose on its link of the first mesh of each link that has one."""
        return {s.link: s.pose for s in self.shapes[::-1] if s.is_mesh}

    def solids(self) -> tuple[LinkSolid, ...]:
        """What is drawn of each link that has a shape: its visual parts, else those that collide.

        Mesh files are read here; one that cannot be is a problem of its link.
        """
        drawn = []
        for link in self.links:
            shapes = [s for s in self.shapes if s.link == link]
            drawn.append([s for s in shapes if s.kind == "visual"] or shapes)
        most = MOST_TRIANGLES // max(1, sum(map(len, drawn)))
        return tuple(_solid(shapes, most) for shapes in drawn if shapes)

    def bones(self, without: Container[str] = ()) -> FloatArray:
        """(n, 2, 3) m: from each link's origin, but those ``without``, to those that it holds."""
        joints = [joint for joint in self.joints.values() if joint.parent not in without]
        ends = [(self.pose(j.parent), self.pose(j.child)) for j in joints]
        return np.array([[a.position, b.position] for a, b in ends]).reshape(-1, 2, 3)

    def _check(self, joints: list[UrdfJoint]) -> None:
        if len(set(self.links)) < len(self.links) or len(self.joints) < len(joints):
            raise SkinError(
                "names a link twice, or gives one link two parent joints", where=self.source
            )
        for joint in joints:
            for end in (joint.parent, joint.child):
                self.check_link(end, f'{self.source}: joint "{joint.name}"')
        roots = [link for link in self.links if link not in self.joints]
        if len(roots) > 1 or not self.links:
            raise SkinError(
                f"expected one link that no joint holds, got {len(roots)}: {', '.join(roots)}",
                where=self.source,
                hint="hold all of them but one by a <joint>",
            )
        for start in self.links:
            link = start
            for _ in joints:
                link = self.joints[link].parent if link in self.joints else ""
            if link in self.joints:
                raise SkinError(f'the joints before link "{start}" form a ring', where=self.source)


def _joint(element: ElementTree.Element, where: str) -> UrdfJoint:
    name = name_of(element, where)
    ends = [element.find(end) for end in ("parent", "child")]
    parent, child = ("" if end is None else end.get("link", "") for end in ends)
    return UrdfJoint(name, parent, child, origin_of(element, f'{where}: joint "{name}"'))


def _solid(shapes: list[LinkShape], most: int) -> LinkSolid:
    link, corners, problems = shapes[0].link, [], []
    for shape in shapes:
        try:
            corners.append(thinned(shape.triangles(), most))
        except GeometryError as error:
            problems.append(str(error))
    return LinkSolid(link, np.concatenate([np.zeros((0, 3, 3)), *corners]), tuple(problems))
