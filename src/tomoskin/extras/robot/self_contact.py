"""Where the robot's own links can touch a skin, by their shapes and by how it stands."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Self

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import ConvexHull, QhullError

from tomoskin.core import FloatArray, GeometryError, SkinError
from tomoskin.extras.robot.link_shapes import LinkShape
from tomoskin.extras.robot.urdf import Urdf
from tomoskin.extras.robot.urdf_joint import Positions

LINGERS = 0.1
"""Seconds for which a touch goes on after a link has gone: some scans tell that it has ended."""

NearLink = Callable[[FloatArray], NDArray[np.bool_]]
"""Which of the points (n, 3) m, in the frame of a skin's link, are near another link."""


@dataclass(frozen=True, slots=True, eq=False)
class Hull:
    """The convex hull of a shape of a ``link``, in the frame of that.

    Attributes
    ----------
    planes
        (n, 4): a point p is within where ``plane[:3] @ p + plane[3]`` is negative for all.
    middle, radius
        m, of a sphere that holds it.
    """

    link: str
    planes: FloatArray = field(repr=False)
    middle: FloatArray
    radius: float

    @classmethod
    def of(cls, shape: LinkShape) -> Self | None:
        """That of a shape; None of a mesh that cannot be read, or is flat."""
        try:
            corners = shape.triangles().reshape(-1, 3)
            planes = np.unique(ConvexHull(corners).equations.round(12), axis=0)
        except (GeometryError, QhullError):
            return None
        middle = (corners.min(axis=0) + corners.max(axis=0)) / 2
        return cls(shape.link, planes, middle, np.linalg.norm(corners - middle, axis=1).max())

    def near(self, points: FloatArray, margin: float) -> NDArray[np.bool_]:
        """(n,) which of ``points`` (n, 3) m are within ``margin`` m of it.

        The distance is that to the farthest plane: near an edge or a corner it is less than the
        true one.
        """
        if np.linalg.norm(points - self.middle, axis=1).min() > self.radius + margin:
            return np.zeros(len(points), dtype=bool)
        distances = (points @ self.planes[:, :3].T + self.planes[:, 3]).max(axis=1)
        return np.asarray(distances < margin)


@dataclass(frozen=True, eq=False)
class OwnLinks:
    """The links of a robot that can touch a skin on one of them.

    A shape counts as its convex hull: exact for boxes, spheres, capsules and cylinders (of 32
    sides), and the bound of a mesh.

    Attributes
    ----------
    link
        What the skin lies on.
    others
        The links that can touch it.
    margin
        m from the shape of a link to the skin within which it touches.
    leaves_out
        Whether such touches are left out of messages, and not marked only.
    """

    urdf: Urdf = field(repr=False)
    link: str
    others: tuple[str, ...]
    margin: float
    leaves_out: bool

    @classmethod
    def of(
        cls, urdf: Urdf, link: str, named: Sequence[str], margin: float, *, leaves_out: bool
    ) -> Self:
        """All links but those of the rigid body of ``link``, and those that one joint holds to it
        unless they are ``named``: next to a joint shapes are always near. Raises SkinError."""
        bodies = {name: urdf.body(name) for name in urdf.links}
        own = bodies[link]
        if fixed := [name for name in named if bodies[name] == own]:
            raise SkinError(
                f'expected links that move against "{link}", got "{fixed[0]}", which fixed joints '
                "hold to it",
                where=urdf.source,
            )
        joined = [{bodies[joint.parent], bodies[child]} for child, joint in urdf.joints.items()]
        near = {own}.union(*(pair for pair in joined if own in pair))
        others = (name for name in urdf.links if name in named or bodies[name] not in near)
        return cls(urdf, link, tuple(others), margin, leaves_out)

    @cached_property
    def hulls(self) -> tuple[Hull, ...]:
        """Those of the shapes of the others; meshes are read here."""
        shapes = [s for link in self.others for s in self.urdf.shapes_of(link, "collision")]
        return tuple(hull for hull in map(Hull.of, shapes) if hull is not None)

    @property
    def problem(self) -> str:
        """Which links have shapes and none that can be read; "" where there are none."""
        blind = {*self.others} - {hull.link for hull in self.hulls}
        unread = ", ".join(dict.fromkeys(s.link for s in self.urdf.shapes if s.link in blind))
        return unread and f"the shapes of {unread} cannot be read"

    def at(self, *stances: Positions) -> NearLink:
        """What tells of points that another link is near, the joints as in one of ``stances``.

        Raises SkinError where the position of a joint is not known.
        """
        links = self.link, *(hull.link for hull in self.hulls)
        placed = [self.urdf.poses(positions, links) for positions in stances]
        return lambda points: np.any(
            [
                hull.near(poses[hull.link].inside(poses[self.link](points)), self.margin)
                for poses in placed
                for hull in self.hulls
            ],
            axis=0,
        )
