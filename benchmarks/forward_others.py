"""The same work by others: a plain scipy script, and pyEIT where it is installed."""

from __future__ import annotations

import math
from collections.abc import Callable
from importlib.metadata import version
from importlib.util import find_spec
from typing import Any

import numpy as np
from scipy.sparse import coo_array, csc_array
from scipy.sparse.linalg import splu

from tomoskin.core import FloatArray
from tomoskin.model.mesh import Mesh
from tomoskin.model.pattern import Pattern


class Script:
    """COO assembly by einsum, ``splu`` as it comes, Jacobian by einsum; geometry is prepared."""

    def __init__(self, mesh: Mesh, pattern: Pattern, contact_impedance: float) -> None:
        self.mesh, self.pattern, self.z = mesh, pattern, contact_impedance
        corner = mesh.points[mesh.cells]
        edges = corner[:, 1:] - corner[:, :1]
        inner = np.linalg.inv(edges).swapaxes(1, 2)
        gradient = np.concatenate([-inner.sum(axis=1, keepdims=True), inner], axis=1)
        volume = np.abs(np.linalg.det(edges)) / math.factorial(mesh.dimension)
        self.gradient = gradient * np.sqrt(volume)[:, None, None]

    def matrix(self, sigma: FloatArray) -> csc_array:
        """System with the last electrode at zero."""
        mesh, n = self.mesh, len(self.mesh.points)
        local = np.einsum("n,nid,njd->nij", sigma, self.gradient, self.gradient)
        k = mesh.cells.shape[1]
        entries = [(np.repeat(mesh.cells, k), np.tile(mesh.cells, k).ravel(), local.ravel())]
        for number, facets in enumerate(mesh.electrodes):
            m = facets.shape[1]
            corner = mesh.points[facets]
            edges = corner[:, 1:] - corner[:, :1]
            gram = np.linalg.det(edges @ edges.swapaxes(1, 2))
            size = np.sqrt(gram) / math.factorial(m - 1) / self.z
            mass = np.multiply.outer(size, (1.0 + np.eye(m)) / (m * (m + 1)))
            entries.append((np.repeat(facets, m), np.tile(facets, m).ravel(), mass.ravel()))
            if number == len(mesh.electrodes) - 1:
                break
            load, own = np.repeat(-size / m, m), np.full(facets.size, n + number)
            entries += [(facets.ravel(), own, load), (own, facets.ravel(), load)]
            entries.append((own[:1], own[:1], size.sum(keepdims=True)))
        rows, cols, values = (np.concatenate(part) for part in zip(*entries, strict=True))
        total = n + len(mesh.electrodes) - 1
        return csc_array(coo_array((values, (rows, cols)), shape=(total, total)))

    def fields(self, sigma: FloatArray) -> FloatArray:
        """(n_unknowns, n_electrodes): 1 A into each electrode, out at the last."""
        matrix, n = self.matrix(sigma), len(self.mesh.points)
        n_basis = matrix.shape[0] - n
        rhs = np.zeros((matrix.shape[0], n_basis))
        rhs[n + np.arange(n_basis), np.arange(n_basis)] = 1.0
        solved = splu(matrix).solve(rhs)
        return np.pad(solved, ((0, 1), (0, 1)))

    def voltages(self, sigma: FloatArray) -> FloatArray:
        """(n_meas,) V."""
        return self._read(self.fields(sigma))

    def jacobian(self, sigma: FloatArray) -> FloatArray:
        """(n_meas, n_cells) V/S."""
        fields = self.fields(sigma)[self.mesh.cells]
        gradient = np.einsum("nid,nik->knd", self.gradient, fields, optimize=True)
        (source, sink), (plus, minus) = self.pattern.drive.T, self.pattern.measure.T
        driven, read = gradient[source] - gradient[sink], gradient[plus] - gradient[minus]
        return -np.einsum("mnd,mnd->mn", driven, read)

    def _read(self, fields: FloatArray) -> FloatArray:
        r = fields[len(self.mesh.points) :]
        (source, sink), (plus, minus) = self.pattern.drive.T, self.pattern.measure.T
        return (r[plus, source] - r[plus, sink]) - (r[minus, source] - r[minus, sink])


INSTALLED = find_spec("pyeit") is not None


def peer_name() -> str:
    """Name and version, or that it is not here."""
    return f"pyEIT {version('pyeit')}" if INSTALLED else "pyEIT is not installed: see the README"


class Peer:
    """Point electrodes, each at the node in the middle of one of ours."""

    def __init__(self, mesh: Mesh, pattern: Pattern) -> None:
        self._mesh, self._pattern = mesh, pattern
        self._nodes = np.array([_middle(mesh, facets) for facets in mesh.electrodes])

    def set_up(self, alpha: float) -> Any:
        """One-step operator, from points and cells."""
        from pyeit.eit.jac import JAC

        solver = JAC(self._its_mesh(), self._protocol())
        solver.setup(p=0.5, lamb=alpha**2, method="kotre")
        return solver.H

    def calls(self, sigma: FloatArray, alpha: float) -> dict[str, Callable[[], object]]:
        """What is timed of it, by name; what is made once per mesh is made here."""
        from pyeit.eit.fem import EITForward

        forward = EITForward(self._its_mesh(), self._protocol())
        return {
            "peer forward": lambda: forward.solve_eit(sigma),
            "peer jacobian": lambda: forward.compute_jac(sigma),
            "peer set-up": lambda: self.set_up(alpha),
        }

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
