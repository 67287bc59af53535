"""A robot's links and joints, from a URDF."""

from __future__ import annotations

from collections.abc import Container, Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Self
from xml.etree import ElementTree

import numpy as np

from tomoskin.core import (
    FloatArray,
    GeometryError,
    SkinError,
    StrPath,
    meant_or_known,
)
from tomoskin.extras.robot.link_shapes import (
    MOST_TRIANGLES,
    LinkShape,
    name_of,
    read_shapes,
    thinned,
)
from tomoskin.extras.robot.packages import expanded
from tomoskin.extras.robot.urdf_joint import (
    STANDS,
    Followed,
    Positions,
    UrdfJoint,
    check_mimics,
    read_joint,
)
from tomoskin.model.mesh import Pose
from tomoskin.model.skin import read_text

_LARGEST = 20_000_000
"""A URDF has at most so many bytes."""


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
        """From a file; a xacro is expanded.

        Raises
        ------
        SkinError
            When it cannot be read or expanded, is no URDF, or its links are no tree.
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
        root = _parsed(text, where)
        if "${" in text or "$(" in text or any("xacro}" in e.tag for e in root.iter()):
            root = _parsed(expanded(path), where)
        if root.tag != "robot":
            raise SkinError(f"expected <robot> with its links, got <{root.tag}>", where=where)
        links = tuple(name_of(link, where) for link in root.findall("link"))
        joints = [read_joint(joint, where) for joint in root.findall("joint")]
        shapes = tuple(read_shapes(root, path))
        urdf = cls(where, root.get("name", ""), links, {j.child: j for j in joints}, shapes)
        urdf._check(joints)
        return urdf

    def check_link(self, link: str, where: str) -> None:
        """Raise SkinError where there is no such link, with the one that may have been meant."""
        if link not in self.links:
            hint = meant_or_known(link, self.links[:20], "its links")
            raise SkinError(f'there is no link "{link}" in {self.source}', where=where, hint=hint)

    @property
    def root(self) -> str:
        """The link that no joint holds."""
        return next(link for link in self.links if link not in self.joints)

    def pose(self, link: str, positions: Positions | None = None) -> Pose:
        """Of a link's frame in that of the root; without ``positions`` every joint is at zero.

        Raises SkinError where the position of a joint is not known.
        """
        return self.poses(positions, (link,))[link]

    def poses(
        self, positions: Positions | None = None, links: Iterable[str] | None = None
    ) -> dict[str, Pose]:
        """Those of some ``links``, or of all in the order of the file, as :meth:`pose` has each."""
        poses = {self.root: Pose()}
        if positions:
            positions = Followed({joint.name: joint for joint in self.joints.values()}, positions)

        def of(link: str) -> Pose:
            if link not in poses:
                joint = self.joints[link]
                moved = joint.moved(positions) if positions else joint.pose
                poses[link] = of(joint.parent) @ moved
            return poses[link]

        return {link: of(link) for link in (self.links if links is None else links)}

    def body(self, link: str) -> str:
        """The first link of the rigid body that ``link`` belongs to."""
        while (joint := self.joints.get(link)) is not None and joint.kind in STANDS:
            link = joint.parent
        return link

    @property
    def meshes(self) -> dict[str, Pose]:
        """Pose on its link of the first mesh of each link that has one."""
        return {s.link: s.pose for s in self.shapes[::-1] if s.is_mesh}

    def shapes_of(self, link: str, kind: str) -> list[LinkShape]:
        """Those of a link that are of the ``kind``, or all where none is."""
        shapes = [s for s in self.shapes if s.link == link]
        return [s for s in shapes if s.kind == kind] or shapes

    def solids(self) -> tuple[LinkSolid, ...]:
        """What is drawn of each link that has a shape: its visual parts, else those that collide.

        Mesh files are read here; one that cannot be is a problem of its link.
        """
        drawn = [self.shapes_of(link, "visual") for link in self.links]
        most = MOST_TRIANGLES // max(1, sum(map(len, drawn)))
        return tuple(_solid(shapes, most) for shapes in drawn if shapes)

    def bones(self, without: Container[str] = ()) -> tuple[tuple[str, str], ...]:
        """Each link, but those ``without``, with each that it holds."""
        joints = self.joints.values()
        return tuple((j.parent, j.child) for j in joints if j.parent not in without)

    def _check(self, joints: list[UrdfJoint]) -> None:
        if len(set(self.links)) < len(self.links) or len(self.joints) < len(joints):
            raise SkinError(
                "names a link twice, or gives one link two parent joints", where=self.source
            )
        for joint in joints:
            for end in (joint.parent, joint.child):
                self.check_link(end, f'{self.source}: joint "{joint.name}"')
        check_mimics({joint.name: joint for joint in joints}, self.source)
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


def _parsed(text: str, where: str) -> ElementTree.Element:
    try:
        return ElementTree.fromstring(text)
    except ElementTree.ParseError as error:
        raise SkinError(f"is not valid XML, so it is not a URDF: {error}", where=where) from None


def _solid(shapes: list[LinkShape], most: int) -> LinkSolid:
    link, corners, problems = shapes[0].link, [], []
    for shape in shapes:
        try:
            corners.append(thinned(shape.triangles(), most))
        except GeometryError as error:
            problems.append(str(error))
    return LinkSolid(link, np.concatenate([np.zeros((0, 3, 3)), *corners]), tuple(problems))
