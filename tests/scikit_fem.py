"""The complete electrode model in scikit-fem: an oracle that shares no code with the library."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import bmat
from scipy.sparse.linalg import splu
from skfem import (
    Basis,
    BilinearForm,
    ElementTetP0,
    ElementTetP1,
    ElementTetP2,
    ElementTriP0,
    ElementTriP1,
    ElementTriP2,
    FacetBasis,
    LinearForm,
    MeshTet,
    MeshTri,
)

from tomoskin.model.mesh import Mesh

ELEMENTS = {
    2: (MeshTri, ElementTriP0, {1: ElementTriP1, 2: ElementTriP2}),
    3: (MeshTet, ElementTetP0, {1: ElementTetP1, 2: ElementTetP2}),
}


@BilinearForm(dtype=np.complex128)
def flow(u: Any, v: Any, w: Any) -> Any:
    """∇v · σ ∇u."""
    d = len(u.grad)
    return sum(w[f"s{a}{b}"] * u.grad[b] * v.grad[a] for a in range(d) for b in range(d))


@BilinearForm
def mass(u: Any, v: Any, _w: Any) -> Any:
    """u v."""
    return u * v


@LinearForm
def load(v: Any, _w: Any) -> Any:
    """v."""
    return 1.0 * v


def transfer_resistance(
    mesh: Mesh, sigma: NDArray[Any], impedance: NDArray[Any], order: int
) -> NDArray[Any]:
    """(n_electrodes, n_electrodes) Ω, complex; ``sigma`` is one tensor (n_cells, d, d) per cell."""
    kind, constant, orders = ELEMENTS[mesh.dimension]
    domain = kind(mesh.points.T.copy(), mesh.cells.T.copy())
    basis = Basis(domain, orders[order](), intorder=2)
    tensor = _fields(basis.with_element(constant()), sigma)
    n_el = len(mesh.electrodes)
    stiff, columns, sizes = flow.assemble(basis, **tensor), [], np.zeros(n_el)
    number = {tuple(f): i for i, f in enumerate(np.sort(domain.facets.T, axis=1).tolist())}
    for e, table in enumerate(mesh.electrodes):
        facets = np.array([number[tuple(f)] for f in np.sort(table, axis=1).tolist()])
        rim = FacetBasis(domain, orders[order](), facets=facets, intorder=4)
        stiff = stiff + mass.assemble(rim) / impedance[e]
        columns.append(-load.assemble(rim)[:, None] / impedance[e])
        sizes[e] = rim.dx.sum()
    return _potentials(stiff, np.hstack(columns), sizes / impedance)


def _fields(basis: Basis, sigma: NDArray[Any]) -> dict[str, Any]:
    """Each component of the tensor, as a field that is constant in each cell."""
    d = sigma.shape[-1]
    fields = {}
    for a, b in np.ndindex(d, d):
        values = np.zeros(basis.N, dtype=sigma.dtype)
        values[basis.element_dofs[0]] = sigma[:, a, b]
        fields[f"s{a}{b}"] = basis.interpolate(values)
    return fields


def _potentials(stiff: Any, side: NDArray[Any], corner: NDArray[Any]) -> NDArray[Any]:
    """Solve with a row that makes the electrodes' potentials sum to zero."""
    n, n_el = side.shape
    ones = np.ones((n_el, 1))
    system = bmat(
        [[stiff, side, None], [side.T, np.diag(corner), ones], [None, ones.T, None]], format="csc"
    )
    rhs = np.zeros((n + n_el + 1, n_el), dtype=np.complex128)
    rhs[n : n + n_el] = np.eye(n_el) - 1.0 / n_el
    return np.asarray(splu(system.astype(np.complex128)).solve(rhs)[n : n + n_el])
