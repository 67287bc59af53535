"""The criterion that needs nothing but the noise: how a light touch would look on the model."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree
from scipy.spatial.distance import cdist

from tomoskin.core import FloatArray, reach
from tomoskin.imaging.choice.alpha_choice import AlphaChoice, Curve, Evidence
from tomoskin.imaging.linear.spectrum import Spectrum
from tomoskin.model.mesh import Mesh

RADIUS = 0.055
"""Radius of the touch, in parts of the breadth of a square (a cube) as large as the mesh."""

DEPTH = 0.25
"""Its relative change of conductivity."""

_POSITIONS = 80
"""Positions that are tried, evenly over the cells."""

_STRIDE = 4
"""One alpha in so many of the fine grid is tried."""


@dataclass(frozen=True, eq=False)
class LightTouch:
    """Expected error of the image of a light touch: lost sharpness, plus the noise's part.

    The mean over positions on the sheet of ∫(x̂ − x)²/∫x², the image's mean square error, is
    quadratic in the data, so it is exact: no noise is drawn. Prepared once for a skin, a choice
    for another noise takes a few milliseconds.

    Attributes
    ----------
    spectrum
        Of the problem.
    alphas
        (k,) that are compared, ascending.
    blur
        (k,) the error without noise.
    size
        ∫x² of a touch, by which the noise's part is divided.
    """

    spectrum: Spectrum
    alphas: FloatArray
    blur: FloatArray
    size: float

    @classmethod
    def of(cls, spectrum: Spectrum) -> Self:
        """Touches all over the mesh of a problem."""
        mesh, alphas = spectrum.problem.model.mesh, spectrum.alphas[::_STRIDE]
        touches = _touches(mesh) * (DEPTH * np.abs(spectrum.problem.conductivity[:, None]))
        size = mesh.volumes @ touches**2
        response = spectrum.analysis @ (spectrum.problem.jacobian @ touches)
        projected = spectrum.modes.conj().T @ (mesh.volumes[:, None] * touches)
        blur = []
        for alpha in alphas:
            reach()
            blur.append(np.mean(_blur(spectrum, alpha, response, projected) / size))
        return cls(spectrum, alphas, 1.0 + np.array(blur), float(1.0 / np.mean(1.0 / size)))

    def __call__(self, noise: FloatArray) -> AlphaChoice:
        """Choice for difference data whose rows have that ``noise``, (n_meas,)."""
        covariance = self.spectrum.noise_coefficients(noise)
        error = self.blur + self.spectrum.energies(self.alphas, covariance) / self.size
        at = int(error.argmin())
        label = "mean square error of a light touch's image"
        return AlphaChoice(
            _least_between(self.alphas, error, at),
            "light-touch",
            "the image of a light touch errs least at the noise of this skin",
            Curve(self.alphas, error, "alpha", label, at),
        )


def light_touch(spectrum: Spectrum, evidence: Evidence) -> AlphaChoice:
    """Least expected error of the image of a light touch; needs the noise and nothing else."""
    noise = evidence.known_noise(len(spectrum.values))
    return LightTouch.of(spectrum)(noise)


def _touches(mesh: Mesh) -> FloatArray:
    """(n_cells, k) 1 in each touch, 0 elsewhere; none lies at the rim."""
    radius = RADIUS * float(mesh.volumes.sum()) ** (1.0 / mesh.dimension)
    rim = np.unique(mesh.boundary)
    apart = cKDTree(mesh.points[rim]).query(mesh.centroids)[0]
    inside = np.flatnonzero(apart > radius)
    if not len(inside):
        inside = np.arange(len(mesh.cells))
    chosen = inside[np.unique(np.linspace(0, len(inside) - 1, _POSITIONS).astype(int))]
    distance = cdist(mesh.centroids, mesh.centroids[chosen])
    distance[chosen, np.arange(len(chosen))] = 0.0
    return np.asarray(distance <= radius, dtype=np.float64)


def _blur(
    spectrum: Spectrum, alpha: float, response: NDArray[Any], projected: NDArray[Any]
) -> FloatArray:
    """(k,) ∫x̂² − 2∫x̂x of each touch."""
    image = spectrum.gains(alpha)[:, None] * response
    square = np.einsum("mt,mt->t", image.conj(), spectrum.overlap @ image)
    return np.asarray(np.real(square - 2.0 * np.einsum("mt,mt->t", projected.conj(), image)))


def _least_between(alphas: FloatArray, error: FloatArray, at: int) -> float:
    """Least of the parabola through three points in log alpha."""
    if at in (0, len(alphas) - 1):
        return float(alphas[at])
    before, least, after = error[at - 1 : at + 2]
    shift = 0.5 * (before - after) / (before - 2.0 * least + after)
    return float(alphas[at] * (alphas[at + 1] / alphas[at]) ** shift)
