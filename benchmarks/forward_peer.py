"""pyEIT on our meshes, through its own interface; the extra ``bench`` brings it."""

from __future__ import annotations

from importlib.metadata import version
from importlib.util import find_spec
from typing import Any

import numpy as np

from tomoskin.core import FloatArray
from tomoskin.model.mesh import Mesh
from tomoskin.model.pattern import Pattern

INSTALLED = find_spec("pyeit") is not None


def name() -> str:
    """Name and version, or that it is not here."""
    return f"pyEIT {version('pyeit')}" if INSTALLED else "pyEIT is not installed: see the README"


class Peer:
    """Point electrodes, each at the node in the middle of one of ours."""

    def __init__(self, mesh: Mesh, pattern: Pattern) -> None:
        self._mesh, self._pattern = mesh, pattern
        self._nodes = np.array([_middle(mesh, facets) for facets in mesh.electrodes])
        self._forward: Any = None

    def prepare(self) -> None:
        """Make what is made once per mesh."""
        from pyeit.eit.fem import EITForward

        self._forward = EITForward(self._its_mesh(), self._protocol())

    def forward(self, sigma: FloatArray) -> object:
        """Voltages."""
        return self._forward.solve_eit(sigma)

    def jacobian(self, sigma: FloatArray) -> object:
        """Jacobian and voltages."""
        return self._forward.compute_jac(sigma)

    def set_up(self, alpha: float) -> object:
        """One-step operator, from points and cells."""
        from pyeit.eit.jac import JAC

        solver = JAC(self._its_mesh(), self._protocol())
        solver.setup(p=0.5, lamb=alpha**2, method="kotre")
        return solver.H

    def _its_mesh(self) -> Any:
        from pyeit.mesh import PyEITMesh

        return PyEITMesh(
            node=np.array(self._mesh.points),
            element=np.array(self._mesh.cells),
            perm=np.ones(len(self._mesh.cells)),
            el_pos=self._nodes,
            ref_node=len(self._mesh.points) - 1,  # not on an electrode
        )

    def _protocol(self) -> Any:
        from pyeit.eit.protocol import PyEITProtocol

        pattern = self._pattern
        reads = pattern.measure.reshape(pattern.n_drive, -1, 2)
        return PyEITProtocol(pattern.drives, reads, np.ones(pattern.n_meas, dtype=bool))


def _middle(mesh: Mesh, facets: Any) -> int:
    nodes = np.unique(facets)
    points = mesh.points[nodes]
    return int(nodes[np.argmin(np.linalg.norm(points - points.mean(axis=0), axis=1))])
