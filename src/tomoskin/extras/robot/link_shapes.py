"""What a robot's links look like: the boxes, cylinders, spheres and mesh files of a URDF."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Literal
from xml.etree.ElementTree import Element

import numpy as np

from tomoskin.core import FloatArray, GeometryError, SkinError
from tomoskin.extras.robot.packages import package_folder
from tomoskin.model.mesh import MeshFile, Pose

MOST_TRIANGLES = 20_000
"""Of all links together: what is finer is drawn more coarsely."""

_AROUND, _UPWARDS = 32, 8
"""Sides of a round shape, and of the quarter of one."""


def name_of(element: Element, where: str) -> str:
    """Its name; SkinError where it has none."""
    name = element.get("name") or ""
    if not name:
        raise SkinError(f"a <{element.tag}> element has no name", where=where)
    return name


def origin_of(element: Element, where: str) -> Pose:
    """The pose that its <origin> says."""
    return Pose.of(*(part_of(element, "origin", key, "0 0 0", where) for key in ("xyz", "rpy")))


def part_of(element: Element, tag: str, key: str, default: str, where: str) -> list[float]:
    """As many finite numbers as ``default`` has, of a part of ``element`` or by default."""
    part = element.find(tag)
    text = default if part is None else part.get(key, default)
    return numbers_of(text, 3 if " " in default else 1, f"<{tag}> {key}", where)


def numbers_of(text: str, count: Literal[1, 3], what: str, where: str) -> list[float]:
    """So many finite numbers between spaces; SkinError that names ``what`` they are of."""
    try:
        numbers = [float(word) for word in text.split()]
    except ValueError:
        numbers = []
    if len(numbers) != count or not all(map(math.isfinite, numbers)):
        words = "a number" if count == 1 else "three numbers"
        raise SkinError(f'expected {words} in {what}, got "{text}"', where=where)
    return numbers


def box(size: FloatArray) -> FloatArray:
    """(12, 3, 3) m: the faces of a box of ``size`` (3,) m, about its middle."""
    corners = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])
    sides = ((0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3))
    table = [part for a, b, c, d in sides for part in ((a, b, c), (a, c, d))]
    return np.asarray(corners[np.array(table)] * size / 2)


def rod(radius: float, length: float) -> FloatArray:
    """(n, 3, 3) m: side and ends of a cylinder about its middle, along z."""
    half = length / 2
    return _turned(np.array([0, radius, radius, 0.0]), np.array([-half, -half, half, half]))


def capsule(radius: float, length: float = 0.0) -> FloatArray:
    """(n, 3, 3) m: two half spheres with a cylinder of ``length`` between, about its middle."""
    up = np.linspace(0.0, np.pi / 2, _UPWARDS + 1)
    radii, heights = radius * np.cos(up), radius * np.sin(up) + length / 2
    return _turned(np.append(radii[::-1], radii), np.append(-heights[::-1], heights))


def mesh_file(path: str, scale: FloatArray, urdf: Path) -> FloatArray:
    """(n, 3, 3) m of a file, ``path`` as the URDF has it, times ``scale`` (3,).

    Raises GeometryError, which names no folder, where it cannot be read.
    """
    unit = abs(float(scale[0]))
    try:
        file = MeshFile.read(_located(path, urdf), scale=unit)
    except GeometryError as error:
        raise GeometryError(error.message, where=path, hint=error.hint) from error
    if file.cells.shape[1] != 3:
        raise GeometryError("expected triangles, got a volume", where=path)
    return np.asarray((file.places * (scale / unit))[file.cells])


def _located(path: str, urdf: Path) -> Path:
    """``package://NAME/FILE`` lies in a folder above the URDF, as packages of ROS have it."""
    scheme, _, rest = path.rpartition("://")
    if scheme != "package":
        return urdf.parent / rest
    package, _, within = rest.partition("/")
    folders = urdf.absolute().parents
    tried = [folder / part for folder in folders for part in (rest, within)]
    if (own := package_folder(package, urdf)) is not None:
        tried.insert(0, own / within)
    return next((file for file in tried if file.is_file()), urdf.parent / within)


@dataclass(frozen=True, slots=True, eq=False)
class LinkShape:
    """One part of a ``link``, its frame at ``pose`` there.

    ``kind`` is "visual" or "collision". ``form`` makes its triangles (n, 3, 3) m in its own frame;
    ``is_mesh``: from a file.
    """

    link: str
    pose: Pose
    kind: str
    form: Callable[[], FloatArray]
    is_mesh: bool

    def triangles(self) -> FloatArray:
        """(n, 3, 3) m, in the link's frame. Raises GeometryError."""
        corners = self.form()
        return self.pose(corners.reshape(-1, 3)).reshape(corners.shape)


def read_shapes(root: Element, urdf: Path) -> Iterator[LinkShape]:
    """Those of each link, visual ones first; SkinError for numbers that cannot be meant."""
    for link in root.findall("link"):
        name = name_of(link, str(urdf))
        where = f'{urdf}: link "{name}"'
        for kind in ("visual", "collision"):
            for part in link.findall(kind):
                geometry = part.find("geometry")
                form = None if geometry is None or not len(geometry) else geometry[0]
                if form is not None and (make := _form(form, where, urdf)) is not None:
                    pose = origin_of(part, where)
                    yield LinkShape(name, pose, kind, make, form.tag == "mesh")


def _form(form: Element, where: str, urdf: Path) -> Callable[[], FloatArray] | None:
    """What makes its triangles; None for a shape that URDFs do not have."""

    def numbers(key: str, count: Literal[1, 3], default: str = "") -> list[float]:
        return numbers_of(form.get(key, default), count, f"<{form.tag}> {key}", where)

    match form.tag:
        case "box":
            return partial(box, np.array(numbers("size", 3)))
        case "cylinder":
            return partial(rod, *numbers("radius", 1), *numbers("length", 1))
        case "capsule":
            return partial(capsule, *numbers("radius", 1), *numbers("length", 1))
        case "sphere":
            return partial(capsule, *numbers("radius", 1))
        case "mesh":
            scale = np.array(numbers("scale", 3, "1 1 1"))
            return partial(mesh_file, form.get("filename", ""), scale, urdf)
    return None


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


def _turned(radii: FloatArray, heights: FloatArray) -> FloatArray:
    """(n, 3, 3) m of a line turned about z, triangles without area left out."""
    angle = np.linspace(0.0, 2.0 * np.pi, _AROUND + 1)
    x, y = (np.outer(radii, part) for part in (np.cos(angle), np.sin(angle)))
    points = np.stack([x, y, np.broadcast_to(heights[:, None], x.shape)], axis=2)
    a, b, c, d = points[:-1, :-1], points[:-1, 1:], points[1:, 1:], points[1:, :-1]
    both = np.stack([np.stack([a, b, c], -2), np.stack([a, c, d], -2)], 2).reshape(-1, 3, 3)
    area = np.linalg.norm(np.cross(both[:, 1] - both[:, 0], both[:, 2] - both[:, 0]), axis=1)
    return np.asarray(both[area > 1e-12 * max(area.max(), 1e-300)])
