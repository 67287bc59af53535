"""Outlines, electrodes and the triangles or tetrahedra between them."""

from tomoskin.model.mesh.boundary import ElectrodeArc, check_arcs
from tomoskin.model.mesh.draped import Draped
from tomoskin.model.mesh.extrude import extrude
from tomoskin.model.mesh.mesh import Mesh, MeshFile
from tomoskin.model.mesh.outline import Disc, Ellipse, Outline
from tomoskin.model.mesh.patch import FacePatch, Patch, WallPatch, ring
from tomoskin.model.mesh.polygon import Polygon, Rectangle
from tomoskin.model.mesh.surface import Cap, Plane, Saddle, Surface, laid_on
from tomoskin.model.mesh.triangles import simplex_measure
from tomoskin.model.mesh.triangulate import Quality, quality, triangulate
from tomoskin.model.mesh.wrapped import Arm, Cylinder, Hinge

__all__ = [
    "Arm",
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
    "Plane",
    "Polygon",
    "Quality",
    "Rectangle",
    "Saddle",
    "Surface",
    "WallPatch",
    "check_arcs",
    "extrude",
    "laid_on",
    "quality",
    "ring",
    "simplex_measure",
    "triangulate",
]
