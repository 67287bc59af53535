"""A robot's links and joints, from a URDF."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from difflib import get_close_matches
from pathlib import Path
from typing import Self
from xml.etree import ElementTree

import numpy as np

from tomoskin.core import FloatArray, SkinError
from tomoskin.robot.pose import Pose
from tomoskin.skin import read_text

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
    meshes
        Pose on its link of the first mesh of each link that has one.
    """

    source: str
    name: str
    links: tuple[str, ...]
    joints: dict[str, UrdfJoint]
    meshes: dict[str, Pose]

    @classmethod
    def read(cls, path: Path) -> Self:
        """From a file.

        Raises
        ------
        SkinError
            When it cannot be read, is no URDF, or its links are no tree.
        """
        text = read_text(path, "a URDF", _LARGEST)
        where = str(path)
        if "<!ENTITY" in text:
            raise SkinError("declares entities, which no URDF needs", where=where)
        try:
            root = ElementTree.fromstring(text)
        except ElementTree.ParseError as error:
            raise SkinError(f"is not valid XML: {error}", where=where) from None
        if root.tag != "robot":
            hint = "expand xacro first: xacro ROBOT.xacro > ROBOT.urdf"
            raise SkinError(f"expected <robot>, got <{root.tag}>", where=where, hint=hint)
        links = tuple(_name(link, where) for link in root.findall("link"))
        joints = [_joint(joint, where) for joint in root.findall("joint")]
        meshes = dict(_meshes(root, where))
        found = cls(where, root.get("name", ""), links, {j.child: j for j in joints}, meshes)
        found._check(joints)
        return found

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

    def bones(self) -> FloatArray:
        """(n_joints, 2, 3) m: from each link's origin to those of the links that it holds."""
        ends = [(self.pose(j.parent), self.pose(j.child)) for j in self.joints.values()]
        return np.array([[a.position, b.position] for a, b in ends]).reshape(-1, 2, 3)

    def _check(self, joints: list[UrdfJoint]) -> None:
        if len(set(self.links)) < len(self.links) or len(self.joints) < len(joints):
            raise SkinError("names a link twice, or holds one by two joints", where=self.source)
        for joint in joints:
            for end in (joint.parent, joint.child):
                self.check_link(end, f'{self.source}: joint "{joint.name}"')
        for start in self.links:
            link = start
            for _ in joints:
                link = self.joints[link].parent if link in self.joints else ""
            if link in self.joints:
                raise SkinError(f'the joints before link "{start}" are a ring', where=self.source)


def _name(element: ElementTree.Element, where: str) -> str:
    name = element.get("name") or ""
    if not name:
        raise SkinError(f"a <{element.tag}> has no name", where=where)
    return name


def _joint(element: ElementTree.Element, where: str) -> UrdfJoint:
    name = _name(element, where)
    ends = [element.find(end) for end in ("parent", "child")]
    parent, child = ("" if end is None else end.get("link", "") for end in ends)
    return UrdfJoint(name, parent, child, _origin(element, f'{where}: joint "{name}"'))


def _meshes(root: ElementTree.Element, where: str) -> Iterator[tuple[str, Pose]]:
    for link in root.findall("link"):
        name = _name(link, where)
        shown = [*link.findall("visual"), *link.findall("collision")]
        for part in shown:
            if part.find("geometry/mesh") is not None:
                yield name, _origin(part, f'{where}: link "{name}"')
                break


def _origin(element: ElementTree.Element, where: str) -> Pose:
    origin = element.find("origin")
    given = {} if origin is None else origin.attrib
    return Pose.of(*(_three(given.get(key, "0 0 0"), where) for key in ("xyz", "rpy")))


def _three(text: str, where: str) -> list[float]:
    try:
        numbers = [float(word) for word in text.split()]
    except ValueError:
        numbers = []
    if len(numbers) != 3 or not all(map(math.isfinite, numbers)):
        raise SkinError(f'expected three numbers in <origin>, got "{text}"', where=where)
    return numbers
