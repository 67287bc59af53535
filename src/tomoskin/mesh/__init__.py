"""Outlines, electrodes and the triangles or tetrahedra between them."""

from tomoskin.mesh.mesh import Mesh
from tomoskin.mesh.topology import simplex_measure

__all__ = ["Mesh", "simplex_measure"]
