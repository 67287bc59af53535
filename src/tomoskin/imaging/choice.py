"""Parameter-choice criteria: alpha from the spectrum and the noise of the data."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq
from scipy.spatial import cKDTree
from scipy.spatial.distance import cdist

from tomoskin.core import DataError, FloatArray, ModelError, no_such, reach
from tomoskin.imaging.linear.spectrum import Spectrum
from tomoskin.imaging.noise_figure import deviations, noise_figure
from tomoskin.model.mesh import Mesh

RADIUS = 0.055
"""Radius of the light touch, in parts of the breadth of a square (a cube) as large as the mesh."""

DEPTH = 0.25
"""Its relative change of conductivity."""

_POSITIONS = 80
"""Positions that are tried, evenly over the cells."""

_STRIDE, _COARSE = 4, 8
"""One alpha in so many of the fine grid is tried for a touch, and one in so many for a crossing."""

TARGET = 1.0
"""Noise figure that is aimed at (Adler & Guardo 1996)."""

WIDTH = 0.1
"""Radius of the contrast in the middle, in parts of the mesh's largest extent."""

ERROR = 0.01
"""What a model gets wrong in a measurement, as a part of the change of the whole frame: a tank's
shape, electrodes and contacts are never quite those of its model."""

_GREATER = 0.9
"""Quantile of the frames' energy that stands for a frame which shows something."""


@dataclass(frozen=True, eq=False)
class Curve:
    """What a criterion looked at: ``y``, called ``label``, over alphas ``x``; and its choice."""

    x: FloatArray
    y: FloatArray
    label: str
    chosen: int


@dataclass(frozen=True, eq=False)
class AlphaChoice:
    """An alpha, the criterion (``rule``) that chose it, the reason, and the curve it is from."""

    alpha: float
    rule: str
    reason: str
    curve: Curve | None = None


def known_noise(noise: FloatArray | None, n_meas: int) -> FloatArray:
    """The deviations (n_meas,) of one frame of difference data; DataError where they are none."""
    if noise is None:
        raise DataError(
            "the noise of the measurements is missing",
            hint="give two or more idle frames as the reference",
        )
    return deviations(noise, n_meas)


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
            Curve(self.alphas, error, label, at),
        )


def light_touch(spectrum: Spectrum, noise: FloatArray | None) -> AlphaChoice:
    """Least expected error of the image of a light touch; needs the noise and nothing else."""
    return LightTouch.of(spectrum)(known_noise(noise, len(spectrum.values)))


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


def model_error(spectrum: Spectrum, noise: FloatArray | None = None) -> AlphaChoice:
    """Each measurement errs by :data:`ERROR` of the change that the prior expects of a frame.

    Needs nothing. The energy of such changes, tr(W^½JQ⁻¹JᴴW^½), does not depend on the mesh, and
    rows that only repeat others leave the image as it is. The part was chosen on recordings of
    tanks, and holds on others that were not looked at for it.
    """
    del noise
    return _trusted(spectrum, ERROR, "")


def for_recording(spectrum: Spectrum, noise: FloatArray | None, frames: FloatArray) -> AlphaChoice:
    """Alpha of a recording of a board that is not known, by what the file says.

    As :func:`model_error`, to which the noise of idle frames is added where it is known: as a part
    of the change of the file's ``frames`` (n, n_meas), by the weights of the problem. Of many
    frames the greater changes count, as some may show nothing.
    """
    if noise is None or not noise.any() or not frames.any():
        return _trusted(spectrum, ERROR, ", as no idle frames tell its noise")
    weights = spectrum.problem.weights
    power, shown = known_noise(noise, len(weights)) ** 2 * weights, frames[frames.any(axis=1)]
    change = float(np.quantile((shown**2 * weights).sum(axis=1), _GREATER)) - power.sum()
    part = float(np.sqrt(power.mean() / max(change, power.sum())))
    why = f", and the noise of its idle frames is {100 * part:.2g} %"
    return _trusted(spectrum, float(np.hypot(ERROR, part)), why)


def _trusted(spectrum: Spectrum, error: float, why: str) -> AlphaChoice:
    """Alpha where each measurement errs by that part of the change of a frame."""
    change = float(spectrum.values[np.isfinite(spectrum.values)].sum()) ** 0.5
    alpha, alphas = error * change, spectrum.alphas
    nearest = int(np.abs(np.log(alphas / alpha)).argmin())
    label = "error of a measurement, part of a frame's change"
    reason = f"measurements are trusted to {100 * ERROR:g} % of a frame's change{why}"
    curve = Curve(alphas, alphas / change, label, nearest)
    return AlphaChoice(alpha, "model-error", reason, curve)


def by_noise_figure(
    spectrum: Spectrum, noise: FloatArray | None = None, target: float = TARGET
) -> AlphaChoice:
    """The alpha whose noise figure is ``target``, for a contrast in the middle of the mesh.

    The noise's size does not count, only how it is spread over the measurements: evenly where it
    is not known. The figure falls as alpha grows; at large alphas it may rise again, where the
    image is no better for being smoother. Raises ModelError when no alpha has that figure before.
    """
    n = len(spectrum.values)
    spread = np.ones(n) if noise is None else known_noise(noise, n)
    volumes = spectrum.problem.model.mesh.volumes
    change = spectrum.problem.jacobian @ in_the_middle(spectrum)

    def figure(alpha: float) -> float:
        return noise_figure(spectrum.operator(alpha).matrix, volumes, change, spread)

    reason = f"the noise figure is {target:g} for a contrast in the middle"
    return where_it_falls(spectrum.alphas[::_COARSE], figure, target, reason)


def where_it_falls(
    alphas: FloatArray, figure: Callable[[float], float], target: float, reason: str
) -> AlphaChoice:
    """The largest of ``alphas`` (ascending) at which a noise figure has fallen to ``target``."""
    values = np.array([figure(float(a)) for a in alphas])
    steps = np.diff((values > target).astype(int))
    fallen = np.flatnonzero(steps == -1)
    if not len(fallen):
        where, size = ("above", "larger") if values[0] > target else ("below", "smaller")
        raise ModelError(
            f"noise figure {'starts' if steps.any() else 'stays'} {where} {target:g}: "
            f"{values.min():.3g} to {values.max():.3g}",
            where="rule noise-figure",
            hint=f"choose a {size} noise figure, or another rule",
        )
    low, high = (float(a) for a in alphas[[fallen[-1], fallen[-1] + 1]])
    root = float(brentq(lambda a: figure(a) - target, low, high, xtol=1e-12 * low))
    nearest = int(np.abs(np.log(alphas / root)).argmin())
    curve = Curve(alphas, values, "noise figure", nearest)
    return AlphaChoice(root, "noise-figure", reason, curve)


def in_the_middle(spectrum: Spectrum) -> FloatArray:
    """(n_cells,) 1 within :data:`WIDTH` of the mesh's middle (one cell at least), else 0."""
    mesh = spectrum.problem.model.mesh
    middle = mesh.volumes @ mesh.centroids / mesh.volumes.sum()
    distance = np.linalg.norm(mesh.centroids - middle, axis=1)
    reach = max(WIDTH * float(np.ptp(mesh.points, axis=0).max()), float(distance.min()))
    return np.asarray(distance <= reach, dtype=np.float64)


RULES: dict[str, Callable[[Spectrum, FloatArray | None], AlphaChoice]] = {
    "light-touch": light_touch,
    "model-error": model_error,
    "noise-figure": by_noise_figure,
}
"""Parameter-choice criteria by name.

``alpha = "auto"`` is decided by the first where the noise is known, else by the second.
"""


def choose(spectrum: Spectrum, rule: str, noise: FloatArray | None = None) -> AlphaChoice:
    """The choice by the criterion that is named ``rule``, for ``noise`` (n_meas,) of the data.

    Raises
    ------
    ModelError
        For an unknown name, or where the criterion finds no alpha.
    DataError
        When the criterion needs the noise, and it is missing or none.
    """
    if rule not in RULES:
        raise ModelError(no_such(rule, RULES, "a rule"))
    return RULES[rule](spectrum, noise)
