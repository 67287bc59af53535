"""Outlines, electrodes and the triangles or tetrahedra between them."""

from tomoskin.model.mesh.boundary import ElectrodeArc as ElectrodeArc, check_arcs as check_arcs
from tomoskin.model.mesh.draped import Draped as Draped
from tomoskin.model.mesh.extrude import (
    FacePatch as FacePatch,
    WallPatch as WallPatch,
    extrude as extrude,
    ring as ring,
)
from tomoskin.model.mesh.mesh import Mesh as Mesh, MeshFile as MeshFile
from tomoskin.model.mesh.outline import Disc as Disc, Ellipse as Ellipse, Outline as Outline
from tomoskin.model.mesh.polygon import (
    Polygon as Polygon,
    Rectangle as Rectangle,
    centroid as centroid,
    inside as inside,
    off_segment as off_segment,
    signed_area as signed_area,
)
from tomoskin.model.mesh.pose import (
    Moved as Moved,
    Pose as Pose,
    pose_numbers as pose_numbers,
    quaternion as quaternion,
)
from tomoskin.model.mesh.surface import (
    Cap as Cap,
    Plane as Plane,
    Saddle as Saddle,
    Surface as Surface,
    laid_on as laid_on,
)
from tomoskin.model.mesh.triangles import simplex_measure as simplex_measure
from tomoskin.model.mesh.triangulate import quality as quality, triangulate as triangulate
from tomoskin.model.mesh.wrapped import Arm as Arm, Cylinder as Cylinder, Hinge as Hinge
