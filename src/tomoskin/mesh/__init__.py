"""Outlines, electrodes and the triangles or tetrahedra between them."""

from tomoskin.mesh.arcs import ElectrodeArc, check_arcs
from tomoskin.mesh.box import BoxPatch, box
from tomoskin.mesh.choose import Places
from tomoskin.mesh.cylinder import cylinder
from tomoskin.mesh.extrude import extrude, extrude_mesh
from tomoskin.mesh.files import MeshFile, read_mesh
from tomoskin.mesh.mesh import Mesh
from tomoskin.mesh.outline import Disc, Ellipse, Outline
from tomoskin.mesh.patch import FacePatch, Patch, WallPatch, ring
from tomoskin.mesh.polygon import Polygon, Rectangle
from tomoskin.mesh.quality import Quality, quality
from tomoskin.mesh.topology import simplex_measure
from tomoskin.mesh.triangulate import triangulate

__all__ = [
    "BoxPatch",
    "Disc",
    "ElectrodeArc",
    "Ellipse",
    "FacePatch",
    "Mesh",
    "MeshFile",
    "Outline",
    "Patch",
    "Places",
    "Polygon",
    "Quality",
    "Rectangle",
    "WallPatch",
    "box",
    "check_arcs",
    "cylinder",
    "extrude",
    "extrude_mesh",
    "quality",
    "read_mesh",
    "ring",
    "simplex_measure",
    "triangulate",
]
