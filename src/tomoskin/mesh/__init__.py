"""Outlines, electrodes and the triangles or tetrahedra between them."""

from tomoskin.mesh.arcs import ElectrodeArc, check_arcs
from tomoskin.mesh.mesh import Mesh
from tomoskin.mesh.outline import Disc, Ellipse, Outline
from tomoskin.mesh.polygon import Polygon, Rectangle
from tomoskin.mesh.quality import Quality, quality
from tomoskin.mesh.topology import simplex_measure
from tomoskin.mesh.triangulate import triangulate

__all__ = [
    "Disc",
    "ElectrodeArc",
    "Ellipse",
    "Mesh",
    "Outline",
    "Polygon",
    "Quality",
    "Rectangle",
    "check_arcs",
    "quality",
    "simplex_measure",
    "triangulate",
]
