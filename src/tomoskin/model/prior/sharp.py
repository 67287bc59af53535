"""Sharp priors: images with edges, or with few changed cells; their cost is not quadratic."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from tomoskin.core import FloatArray, ModelError
from tomoskin.model.mesh import Mesh
from tomoskin.model.prior.penalty import Diagonal, Penalty, sparse_penalty
from tomoskin.model.prior.smooth import graph_laplacian


class SharpPrior(Protocol):
    """A prior whose quadratic follows the image."""

    def penalty(self, mesh: Mesh, jacobian: NDArray[Any]) -> Penalty:
        """The quadratic at an image of nothing, with which an iteration begins."""
        ...

    def touching(self, mesh: Mesh, image: FloatArray) -> Penalty:
        """The quadratic that touches the cost at ``image`` (n_cells,)."""
        ...

    def energy(self, mesh: Mesh, image: FloatArray) -> float:
        """The cost of ``image``, in the units of xᵀQx."""
        ...


@dataclass(frozen=True)
class TotalVariation:
    """Cost 2 Σ sizeᵢⱼ √((xᵢ − xⱼ)² + β²): twice the jumps times the length of their edges.

    Total variation of an image that is constant on the cells (Borsic et al. 2010), relative to
    the root of the domain's content, so that alpha does not depend on the unit of length.

    Attributes
    ----------
    smoothing
        β, in the image's unit: differences below it are smoothed, larger ones are edges.
    """

    smoothing: float = 0.01

    def penalty(self, mesh: Mesh, jacobian: NDArray[Any]) -> Penalty:
        """The quadratic at an image of nothing."""
        return self.touching(mesh, np.zeros(jacobian.shape[1]))

    def touching(self, mesh: Mesh, image: FloatArray) -> Penalty:
        """The weighted graph Laplacian near an image."""
        step = self._jumps(mesh, image)
        return sparse_penalty(
            graph_laplacian(mesh, _edges(mesh) / np.sqrt(step**2 + self._beta**2))
        )

    def energy(self, mesh: Mesh, image: FloatArray) -> float:
        """The cost of ``image``; zero for a constant."""
        beta = self._beta
        length = np.sqrt(self._jumps(mesh, image) ** 2 + beta**2) - beta
        return float(2.0 * _edges(mesh) @ length)

    @property
    def _beta(self) -> float:
        return _positive(self.smoothing)

    def _jumps(self, mesh: Mesh, image: FloatArray) -> FloatArray:
        first, second = mesh.neighbours.T
        return np.asarray(image[first] - image[second])


@dataclass(frozen=True)
class Sparse:
    """Cost 2 Σ wᵢ √(xᵢ² + β²), L1 of the image: few cells differ from the background.

    wᵢ is the cell's share of the domain, so that a finer mesh holds the same image.

    Attributes
    ----------
    smoothing
        β, in the image's unit.
    """

    smoothing: float = 0.01

    def penalty(self, mesh: Mesh, jacobian: NDArray[Any]) -> Penalty:
        """The quadratic at an image of nothing."""
        return self.touching(mesh, np.zeros(jacobian.shape[1]))

    def touching(self, mesh: Mesh, image: FloatArray) -> Penalty:
        """The diagonal matrix near an image."""
        share = mesh.volumes / mesh.volumes.sum()
        return Diagonal(share / np.sqrt(image**2 + _positive(self.smoothing) ** 2))

    def energy(self, mesh: Mesh, image: FloatArray) -> float:
        """The cost of ``image``; zero for nothing."""
        beta = _positive(self.smoothing)
        share = mesh.volumes / mesh.volumes.sum()
        return float(2.0 * share @ (np.sqrt(image**2 + beta**2) - beta))


def _positive(smoothing: float) -> float:
    if not (np.isfinite(smoothing) and smoothing > 0):
        raise ModelError(f"expected a smoothing above 0, got {smoothing}")
    return smoothing


def _edges(mesh: Mesh) -> FloatArray:
    """(n_pairs,) size of the facet that two neighbours share, over that of the domain."""
    shared = _shared_facets(mesh)
    d = mesh.dimension
    return np.asarray(mesh.facet_sizes(shared) / mesh.volumes.sum() ** ((d - 1) / d))


def _shared_facets(mesh: Mesh) -> NDArray[np.int64]:
    """(n_pairs, k − 1) points that both cells of a pair have."""
    first, second = (mesh.cells[cells] for cells in mesh.neighbours.T)
    common = (first[:, :, None] == second[:, None, :]).any(axis=2)
    return np.asarray(first[common].reshape(len(first), -1))
