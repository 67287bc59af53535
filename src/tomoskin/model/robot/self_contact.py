"""Where the robot's own links can touch a skin, by their shapes and by how it stands."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Self

import numpy as np
from scipy.spatial import ConvexHull, QhullError

from tomoskin.core import FloatArray, GeometryError, SkinError
from tomoskin.model.robot.link_shapes import LinkShape
from tomoskin.model.robot.urdf import Positions, Urdf

NearLink = Callable[[FloatArray], bool]
"""Whether one of the points (n, 3) m, in the frame of a skin's link, is near another link."""


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
    leaves_out: bool = False

    @classmethod
    def of(
        cls,
        urdf: Urdf,
        link: str,
        *,
        named: Sequence[str] = (),
        margin: float,
        leaves_out: bool = False,
    ) -> Self:
        """All links but those of the rigid body of ``link``, and those that one joint holds to it
        unless they are ``named``: next to a joint shapes are always near. Raises SkinError."""
        own, hinged = urdf.body(link), urdf.hinged_to(link)
        for name in named:
            if urdf.body(name) == own:
                raise SkinError(
                    f'expected links that move against "{link}", got "{name}", which fixed joints '
                    "hold to it",
                    where=urdf.source,
                )
        others = (n for n in urdf.links if urdf.body(n) != own)
        others = (n for n in others if n in named or urdf.body(n) not in hinged)
        return cls(urdf, link, tuple(others), margin, leaves_out)

    @cached_property
    def hulls(self) -> tuple[tuple[str, FloatArray], ...]:
        """Links, and the planes (n, 4) of one of their shapes: a point p is within where
        ``plane[:3] @ p + plane[3]`` is negative for all. Meshes are read here."""
        shapes = [s for link in self.others for s in self.urdf.shapes_of(link, "collision")]
        return tuple((s.link, planes) for s in shapes if (planes := _planes(s)) is not None)

    @property
    def unread(self) -> tuple[str, ...]:
        """The links whose touches cannot be known, since no shape of theirs can be read."""
        shaped = {link for link, _ in self.hulls}
        unread = (s.link for s in self.urdf.shapes if s.link in {*self.others} - shaped)
        return tuple(dict.fromkeys(unread))

    def at(self, positions: Positions) -> NearLink:
        """What tells of points that another link is near, at these positions of the joints.

        Raises SkinError where one is not known.
        """
        if not self.hulls:
            return lambda _: False
        own = self.urdf.pose(self.link, positions)
        poses = {link: self.urdf.pose(link, positions) for link, _ in self.hulls}

        def is_near(points: FloatArray) -> bool:
            in_root = own(points)
            return any(
                _distances(planes, poses[link].inside(in_root)).min() < self.margin
                for link, planes in self.hulls
            )

        return is_near


def _planes(shape: LinkShape) -> FloatArray | None:
    """(n, 4) of the convex hull of a shape; None of a mesh that cannot be read, or is flat."""
    try:
        hull = ConvexHull(shape.triangles().reshape(-1, 3))
    except (GeometryError, QhullError):
        return None
    return np.unique(hull.equations.round(12), axis=0)


def _distances(planes: FloatArray, points: FloatArray) -> FloatArray:
    """(n,) m to the farthest plane: inside the distance to the surface, outside at most that."""
    return np.asarray((points @ planes[:, :3].T + planes[:, 3]).max(axis=1))
