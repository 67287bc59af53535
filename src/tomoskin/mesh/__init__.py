"""Outlines, electrodes and the triangles or tetrahedra between them."""

from tomoskin.mesh.boundary import ElectrodeArc, check_arcs
from tomoskin.mesh.box import BoxPatch, box
from tomoskin.mesh.choose import Places
from tomoskin.mesh.domed import Cap, Saddle
from tomoskin.mesh.draped import Draped
from tomoskin.mesh.extrude import cylinder, extrude, extrude_mesh
from tomoskin.mesh.mesh import Mesh, MeshFile, read_mesh
from tomoskin.mesh.outline import Disc, Ellipse, Outline
from tomoskin.mesh.patch import FacePatch, Patch, WallPatch, ring
from tomoskin.mesh.polygon import Polygon, Rectangle
from tomoskin.mesh.surface import Plane, Surface, laid_on
from tomoskin.mesh.triangles import simplex_measure
from tomoskin.mesh.triangulate import Quality, quality, triangulate
from tomoskin.mesh.wrapped import Arm, Cylinder, Hinge

__all__ = [
    "Arm",
    "BoxPatch",
    "Cap",
    "Cylinder",
    "Disc",
    "Draped",
    "ElectrodeArc",
    "Ellipse",
    "FacePatch",
    "Hinge",
    "Mesh",
    "MeshFile",
    "Outline",
    "Patch",
    "Places",
    "Plane",
    "Polygon",
    "Quality",
    "Rectangle",
    "Saddle",
    "Surface",
    "WallPatch",
    "box",
    "check_arcs",
    "cylinder",
    "extrude",
    "extrude_mesh",
    "laid_on",
    "quality",
    "read_mesh",
    "ring",
    "simplex_measure",
    "triangulate",
]
