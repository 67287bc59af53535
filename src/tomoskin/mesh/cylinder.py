"""The round tank: a cylinder with a ring of electrodes."""

from __future__ import annotations

from tomoskin.mesh.extrude import extrude
from tomoskin.mesh.mesh import Mesh
from tomoskin.mesh.outline import Disc
from tomoskin.mesh.patch import ring


def cylinder(
    radius: float,
    height: float,
    *,
    count: int,
    width: float,
    bottom: float,
    top: float,
    cells: int = 1600,
    layers: int = 12,
) -> Mesh:
    """Cylinder from z = 0 to ``height`` with ``count`` equal electrodes in one plane; lengths in m.

    They have the arclength ``width``, reach from ``bottom`` to ``top``, and are numbered as
    :func:`ring` does. For other electrodes, give :func:`extrude` a ``Disc`` and their patches.

    Raises
    ------
    GeometryError
        When the electrodes do not fit.
    """
    disc = Disc(radius)
    patches = ring(disc, count, width, bottom, top)
    return extrude(disc, height, patches, cells=cells, layers=layers)
