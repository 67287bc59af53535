"""Parameter-choice criteria: alpha from the spectrum, and from evidence beside it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree
from scipy.spatial.distance import cdist

from tomoskin.core import DataError, FloatArray, IntArray, ModelError, reach
from tomoskin.imaging.choice.alpha_choice import AlphaChoice, Curve, Evidence, Locate, crossing
from tomoskin.imaging.linear.spectrum import Spectrum
from tomoskin.imaging.trained.merit import noise_figure
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


_LEAST = 0.3
"""Total turn, in rad, below which a curve has no corner: a straight line or a gentle arc."""

TARGET = 1.0
"""Noise figure that is aimed at (Adler & Guardo 1996)."""

WIDTH = 0.1
"""Radius of the contrast in the middle, in parts of the mesh's largest extent."""

ERROR = 0.01
"""What a model gets wrong in a measurement, as a part of the change of the whole frame: a tank's
shape, electrodes and contacts are never quite those of its model."""

_GREATER = 0.9
"""Quantile of the frames' energy that stands for a frame which shows something."""

FOLDS = 5

_PER_DECADE = 8

_MISSED = 0.25
"""A press that is not found counts as this part of the mesh's largest extent."""

Criterion = Callable[[Spectrum, Evidence], AlphaChoice]


def corner(t: FloatArray, x: FloatArray, y: FloatArray) -> int:
    """Index of the largest curvature of the curve (x, y) over its parameter t, ascending.

    The curve falls from left to right; only bends towards the origin count, and the ends do
    not. Hansen & O'Leary 1993, equation 4.

    Raises
    ------
    ModelError
        When the curve does not bend towards the origin anywhere, or hardly.
    """
    dx, dy = np.gradient(x, t), np.gradient(y, t)
    ddx, ddy = np.gradient(dx, t), np.gradient(dy, t)
    speed = np.maximum(dx**2 + dy**2, np.finfo(float).tiny)
    # with t ascending x grows and y falls: a bend towards the origin turns left
    turn = (dx * ddy - dy * ddx) / speed
    curvature = turn / np.sqrt(speed)
    inner = np.arange(len(t))[3:-3]
    peaks = [i for i in inner if curvature[i] == curvature[i - 3 : i + 4].max() and turn[i] > 0]
    bends = [i for i in peaks if _turned(t, turn, i) >= _LEAST]
    if not bends:
        raise ModelError(
            "the L-curve has no corner",
            where="rule l-curve",
            hint="choose another rule, such as model-error or light-touch",
        )
    return int(max(bends, key=lambda i: curvature[i]))


def _turned(t: FloatArray, turn: FloatArray, at: int) -> float:
    """Angle, in rad, by which the curve turns to the left around ``at``, as far as it does."""
    right = np.flatnonzero(turn[at:] <= 0)
    left = np.flatnonzero(turn[at::-1] <= 0)
    stop = at + (int(right[0]) if len(right) else len(t) - at)
    start = at + 1 - (int(left[0]) if len(left) else at + 1)
    return float(np.trapezoid(turn[start:stop], t[start:stop]))


def l_curve(spectrum: Spectrum, evidence: Evidence) -> AlphaChoice:
    """Corner of (log residual, log seminorm): the point of largest curvature (Hansen 1992).

    Needs frames; their squares are added up. For very smooth images it trusts the data too much
    (Hanke 1996). Raises ModelError when there is no corner.
    """
    frames = evidence.touched(len(spectrum.values))
    alphas = spectrum.alphas
    residual = np.array([np.linalg.norm(spectrum.residual(a, frames)) for a in alphas])
    seminorm = np.array([np.linalg.norm(spectrum.seminorm(a, frames)) for a in alphas])
    at = corner(np.log(alphas), np.log(residual), np.log(seminorm))
    curve = Curve(residual, seminorm, "residual ‖Jx − dv‖_W", "seminorm √(xᵀQx)", at)
    reason = f"the L-curve of {_frames(frames)} bends most here"
    return AlphaChoice(float(alphas[at]), "l-curve", reason, curve)


def model_error(spectrum: Spectrum, evidence: Evidence) -> AlphaChoice:
    """Each measurement errs by :data:`ERROR` of the change that the prior expects of a frame.

    Needs nothing. The energy of such changes, tr(W^½JQ⁻¹JᴴW^½), does not depend on the mesh, and
    rows that only repeat others leave the image as it is. The part was chosen on recordings of
    tanks, and holds on others that were not looked at for it.
    """
    del evidence
    return _trusted(spectrum, ERROR, "")


def for_recording(spectrum: Spectrum, evidence: Evidence) -> AlphaChoice:
    """Alpha of a recording of a board that is not known, by what the file says.

    As :func:`model_error`, to which the noise of idle frames is added where the evidence has it:
    as a part of the change of its own frames, by the weights of the problem. Of many frames the
    greater changes count, as some may show nothing.
    """
    if evidence.noise is None or not np.any(evidence.noise):
        return _trusted(spectrum, ERROR, ", as no idle frames tell its noise")
    weights = spectrum.problem.weights
    noise = evidence.known_noise(len(weights)) ** 2 * weights
    frames = evidence.touched(len(weights))
    change = float(np.quantile((frames**2 * weights).sum(axis=1), _GREATER)) - noise.sum()
    part = float(np.sqrt(noise.mean() / max(change, noise.sum())))
    why = f", and the noise of its idle frames is {100 * part:.2g} %"
    return _trusted(spectrum, float(np.hypot(ERROR, part)), why)


def _trusted(spectrum: Spectrum, error: float, why: str) -> AlphaChoice:
    """Alpha where each measurement errs by that part of the change of a frame."""
    change = float(spectrum.values[np.isfinite(spectrum.values)].sum()) ** 0.5
    alpha, alphas = error * change, spectrum.alphas
    nearest = int(np.abs(np.log(alphas / alpha)).argmin())
    label = "error of a measurement, part of a frame's change"
    reason = f"measurements are trusted to {100 * ERROR:g} % of a frame's change{why}"
    curve = Curve(alphas, alphas / change, "alpha", label, nearest)
    return AlphaChoice(alpha, "model-error", reason, curve)


def discrepancy(spectrum: Spectrum, evidence: Evidence) -> AlphaChoice:
    """The alpha whose residual is as large as the noise, Σ r²w = Σ noise²w (Morozov 1966).

    Needs frames and noise. Raises ModelError when no alpha gives such a residual.
    """
    frames = evidence.touched(len(spectrum.values))
    noise = evidence.known_noise(len(spectrum.values))
    level = float(np.sqrt(np.sum(noise**2 * spectrum.problem.weights)))

    def excess(alpha: float) -> float:
        return float(np.sqrt(np.mean(spectrum.residual(alpha, frames) ** 2))) / level

    return crossing(
        spectrum,
        excess,
        1.0,
        rising=True,
        rule="discrepancy",
        reason=f"the residual of {_frames(frames)} is as large as the noise",
        label="residual / noise",
        hints=(
            "the model does not explain these frames to within their noise: choose another rule",
            "these frames hold little more than noise: give frames with touches",
        ),
    )


def _frames(frames: FloatArray) -> str:
    return "1 frame" if len(frames) == 1 else f"{len(frames)} frames"


def by_noise_figure(spectrum: Spectrum, evidence: Evidence, target: float = TARGET) -> AlphaChoice:
    """The alpha whose noise figure is ``target``, for a contrast in the middle of the mesh.

    The noise's size does not count, only how it is spread over the measurements: evenly where the
    evidence does not say. The figure falls as alpha grows; at large alphas it may rise again,
    where the image is no better for being smoother. Raises ModelError when no alpha has that
    figure before.
    """
    n = len(spectrum.values)
    noise = np.ones(n) if evidence.noise is None else evidence.known_noise(n)
    volumes = spectrum.problem.model.mesh.volumes
    change = spectrum.problem.jacobian @ in_the_middle(spectrum)

    def figure(alpha: float) -> float:
        return noise_figure(spectrum.operator(alpha).matrix, volumes, change, noise)

    return crossing(
        spectrum,
        figure,
        target,
        rising=False,
        rule="noise-figure",
        reason=f"the noise figure is {target:g} for a contrast in the middle",
        label="noise figure",
        hints=(
            "choose a larger noise figure, or another rule",
            "choose a smaller noise figure, or another rule",
        ),
    )


def in_the_middle(spectrum: Spectrum) -> FloatArray:
    """(n_cells,) 1 within :data:`WIDTH` of the mesh's middle (one cell at least), else 0."""
    mesh = spectrum.problem.model.mesh
    middle = mesh.volumes @ mesh.centroids / mesh.volumes.sum()
    distance = np.linalg.norm(mesh.centroids - middle, axis=1)
    reach = max(WIDTH * float(np.ptp(mesh.points, axis=0).max()), float(distance.min()))
    return np.asarray(distance <= reach, dtype=np.float64)


def labelled(spectrum: Spectrum, evidence: Evidence) -> AlphaChoice:
    """Least mean distance between presses and the touches found, in log alpha averaged over folds.

    In each of five folds alpha is chosen without the fold's presses, and the error stated is
    that on them. Needs frames, their positions and a function that finds touches in an image.
    """
    frames, positions = evidence.labelled(len(spectrum.values))
    if evidence.locate is None:
        raise DataError(
            "the rule needs the method that finds touches in an image, and none was given",
            where="rule labelled",
        )
    alphas = spectrum.alphas[:: _step(spectrum)]
    errors = np.array([_errors(spectrum, a, frames, positions, evidence.locate) for a in alphas])
    chosen, held_out = _folded(errors)
    alpha = float(np.exp(np.log(alphas[chosen]).mean()))
    at = int(np.abs(np.log(alphas / alpha)).argmin())
    reason = (
        f"{len(frames)} labelled presses are found to {1e3 * held_out:.1f} mm on average, "
        "each by an alpha chosen without it"
    )
    curve = Curve(alphas, 1e3 * errors.mean(axis=1), "alpha", "mean position error, mm", at)
    return AlphaChoice(alpha, "labelled", reason, curve)


def _step(spectrum: Spectrum) -> int:
    alphas = spectrum.alphas
    decades = float(np.log10(alphas[-1] / alphas[0]))
    return max(round(len(alphas) / (decades * _PER_DECADE)), 1)


def _errors(
    spectrum: Spectrum, alpha: float, frames: FloatArray, positions: FloatArray, locate: Locate
) -> FloatArray:
    """(n,) m: distance of each press to the nearest touch; more touches than one cost as well."""
    images = (spectrum.coefficients(frames) * spectrum.gains(alpha)) @ spectrum.modes.T
    missed = _MISSED * float(np.ptp(spectrum.problem.model.mesh.points, axis=0).max())
    return np.array(
        [_error(locate(x), at, missed) for x, at in zip(images, positions, strict=True)]
    )


def _error(touches: FloatArray, position: FloatArray, missed: float) -> float:
    if not len(touches):
        return missed
    nearest = float(np.linalg.norm(touches - position, axis=1).min())
    return (min(nearest, missed) + missed * (len(touches) - 1)) / len(touches)


def _folded(errors: FloatArray) -> tuple[IntArray, float]:
    """Index chosen in each fold, and the mean error of its held-out presses."""
    n = errors.shape[1]
    fold = np.arange(n) % min(FOLDS, n)
    chosen, held_out = [], np.empty(n)
    for k in range(int(fold.max()) + 1):
        best = int(errors[:, fold != k].mean(axis=1).argmin())
        held_out[fold == k] = errors[best, fold == k]
        chosen.append(best)
    return np.array(chosen), float(held_out.mean())


RULES: dict[str, Criterion] = {
    "light-touch": light_touch,
    "model-error": model_error,
    "noise-figure": by_noise_figure,
    "l-curve": l_curve,
    "discrepancy": discrepancy,
    "labelled": labelled,
}
"""Parameter-choice criteria by name.

``alpha = "auto"`` is decided by the first where the noise is known, else by the second.
"""


def choose(spectrum: Spectrum, rule: str, evidence: Evidence) -> AlphaChoice:
    """The choice by the criterion that is named ``rule``.

    Raises
    ------
    ModelError
        For an unknown name, or where the criterion finds no alpha.
    DataError
        When the evidence lacks what the criterion needs.
    """
    if rule not in RULES:
        raise ModelError(f'expected a rule among {", ".join(RULES)}, got "{rule}"')
    return RULES[rule](spectrum, evidence)
