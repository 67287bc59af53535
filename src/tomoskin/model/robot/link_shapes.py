"""What a robot's links look like: the boxes, cylinders, spheres and mesh files of a URDF."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from xml.etree.ElementTree import Element

import numpy as np

from tomoskin.core import FloatArray, GeometryError
from tomoskin.model.mesh import MeshFile
from tomoskin.model.robot.elements import name_of, numbers_of, origin_of
from tomoskin.model.robot.pose import Pose

MOST_TRIANGLES = 20_000
"""Of all links together: what is finer is drawn more coarsely."""

_AROUND, _UPWARDS = 32, 16
"""Sides of a round shape."""


@dataclass(frozen=True, slots=True, eq=False)
class Box:
    """Of ``size`` (3,) m, about its middle."""

    size: FloatArray

    def triangles(self) -> FloatArray:
        """Triangles (12, 3, 3) m of the faces."""
        corners = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])
        sides = ((0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3))
        table = [part for a, b, c, d in sides for part in ((a, b, c), (a, c, d))]
        return np.asarray(corners[np.array(table)] * self.size / 2)


@dataclass(frozen=True, slots=True)
class Rod:
    """A cylinder about its middle, along z; m."""

    radius: float
    length: float

    def triangles(self) -> FloatArray:
        """(n, 3, 3) m: the side, and both ends."""
        r, half = self.radius, self.length / 2
        return _turned(np.array([0, r, r, 0.0]), np.array([-half, -half, half, half]))


@dataclass(frozen=True, slots=True)
class Ball:
    """A sphere, measures in m."""

    radius: float

    def triangles(self) -> FloatArray:
        """Triangles (n, 3, 3) m of the surface."""
        up = np.linspace(-np.pi / 2, np.pi / 2, _UPWARDS + 1)
        return _turned(self.radius * np.cos(up), self.radius * np.sin(up))


@dataclass(frozen=True, slots=True, eq=False)
class LinkMesh:
    """A mesh file, ``path`` as the URDF has it, and its scale (3,)."""

    path: str
    scale: FloatArray
    urdf: Path

    def triangles(self) -> FloatArray:
        """(n, 3, 3) m. Raises GeometryError, which names no folder, where it cannot be read."""
        unit = abs(float(self.scale[0]))
        try:
            file = MeshFile.read(self._found(), scale=unit)
        except GeometryError as error:
            raise GeometryError(error.message, where=self.path, hint=error.hint) from error
        if file.cells.shape[1] != 3:
            raise GeometryError("expected triangles, got a volume", where=self.path)
        points = np.zeros((len(file.points), 3))
        points[:, : file.points.shape[1]] = file.points
        return np.asarray((points * (self.scale / unit))[file.cells])

    def _found(self) -> Path:
        """``package://NAME/FILE`` lies in a folder above the URDF, as packages of ROS have it."""
        scheme, _, rest = self.path.rpartition("://")
        if scheme != "package":
            return self.urdf.parent / rest
        within = rest.partition("/")[2]
        folders = self.urdf.absolute().parents
        tried = [folder / part for folder in folders for part in (rest, within)]
        return next((file for file in tried if file.is_file()), self.urdf.parent / within)


@dataclass(frozen=True, slots=True, eq=False)
class LinkShape:
    """One part of a ``link``, its frame at ``pose`` there; ``seen``: not only for collisions."""

    link: str
    pose: Pose
    form: Box | Rod | Ball | LinkMesh
    seen: bool

    def triangles(self) -> FloatArray:
        """(n, 3, 3) m, in the link's frame. Raises GeometryError."""
        corners = self.form.triangles()
        return self.pose(corners.reshape(-1, 3)).reshape(corners.shape)


def read_shapes(root: Element, urdf: Path) -> Iterator[LinkShape]:
    """Those of each link, seen ones first; SkinError for numbers that cannot be meant."""
    for link in root.findall("link"):
        name = name_of(link, str(urdf))
        where = f'{urdf}: link "{name}"'
        for kind in ("visual", "collision"):
            for part in link.findall(kind):
                form = _form(part.find("geometry"), where, urdf)
                if form is not None:
                    yield LinkShape(name, origin_of(part, where), form, kind == "visual")


def thinned(triangles: FloatArray, most: int) -> FloatArray:
    """At most so many of (n, 3, 3) triangles: corners move to a grid that is as fine as it can."""
    extent = float(np.ptp(triangles.reshape(-1, 3), axis=0).max()) if len(triangles) else 0.0
    lines = 2.0 * np.sqrt(most)
    while len(triangles) > most and lines > 1:
        step = extent / lines
        grid = np.rint(triangles / step).astype(np.int64)
        same = (grid == np.roll(grid, 1, axis=1)).all(axis=2).any(axis=1)
        triangles = np.unique(grid[~same], axis=0) * step
        lines *= 0.7
    return triangles[:most]


def _form(geometry: Element | None, where: str, urdf: Path) -> Box | Rod | Ball | LinkMesh | None:
    """None: of a shape that URDFs do not have."""
    form = None if geometry is None or not len(geometry) else geometry[0]
    match None if form is None else form.tag, {} if form is None else form.attrib:
        case "box", given:
            return Box(np.array(numbers_of(given.get("size", ""), 3, "<box> size", where)))
        case "cylinder", given:
            radius = numbers_of(given.get("radius", ""), 1, "<cylinder> radius", where)
            return Rod(*radius, *numbers_of(given.get("length", ""), 1, "<cylinder> length", where))
        case "sphere", given:
            return Ball(*numbers_of(given.get("radius", ""), 1, "<sphere> radius", where))
        case "mesh", given:
            scale = numbers_of(given.get("scale", "1 1 1"), 3, "<mesh> scale", where)
            return LinkMesh(given.get("filename", ""), np.array(scale), urdf)
    return None


def _turned(radii: FloatArray, heights: FloatArray) -> FloatArray:
    """(n, 3, 3) m of a line turned about z, triangles without area left out."""
    angle = np.linspace(0.0, 2.0 * np.pi, _AROUND + 1)
    x, y = (np.outer(radii, part) for part in (np.cos(angle), np.sin(angle)))
    points = np.stack([x, y, np.broadcast_to(heights[:, None], x.shape)], axis=2)
    a, b, c, d = points[:-1, :-1], points[:-1, 1:], points[1:, 1:], points[1:, :-1]
    both = np.stack([np.stack([a, b, c], -2), np.stack([a, c, d], -2)], 2).reshape(-1, 3, 3)
    area = np.linalg.norm(np.cross(both[:, 1] - both[:, 0], both[:, 2] - both[:, 0]), axis=1)
    return np.asarray(both[area > 1e-12 * max(area.max(), 1e-300)])
