"""Outlines, electrodes and the triangles or tetrahedra between them."""

from tomoskin.mesh.mesh import Mesh, simplex_measure

__all__ = ["Mesh", "simplex_measure"]
