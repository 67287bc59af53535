"""Rules that read alpha from frames of a touched skin."""

from __future__ import annotations

import numpy as np

from tomoskin.core import FloatArray
from tomoskin.inverse.choice import AlphaChoice, Curve, Evidence
from tomoskin.inverse.corner import corner
from tomoskin.inverse.search import Level, Told, crossing, least
from tomoskin.inverse.spectrum import Spectrum


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


def gcv(spectrum: Spectrum, evidence: Evidence) -> AlphaChoice:
    """Least generalised cross-validation error, ‖r‖²_W/(1 − f/m)² (Golub, Heath & Wahba 1979).

    f are the degrees of freedom. Needs frames, not the size of their noise.
    """
    frames = evidence.touched(len(spectrum.values))
    m = len(spectrum.values)

    def error(alpha: float) -> float:
        left = 1.0 - spectrum.freedom(alpha) / m
        return float(np.mean(spectrum.residual(alpha, frames) ** 2)) / (m * left**2)

    reason = f"{_frames(frames)} predict each row best from the others here"
    return least(spectrum, error, Told("gcv", reason, "mean square error of prediction"))


def likelihood(spectrum: Spectrum, evidence: Evidence) -> AlphaChoice:
    """Most likely alpha, if images come from the prior: N(0, τ²Q⁻¹) under noise N(0, ν²W⁻¹).

    alpha is ν/τ, and the data's coefficients are N(0, τ²(λ + α²)); τ is each frame's own
    (empirical Bayes; Rasmussen & Williams 2006, section 5.4). Needs frames.
    """
    frames = evidence.touched(len(spectrum.values))
    weighed = np.isfinite(spectrum.values)
    values, m = spectrum.values[weighed], int(weighed.sum())
    energy = np.abs(spectrum.coefficients(frames)[:, weighed]) ** 2

    def unlikely(alpha: float) -> float:
        variance = values + alpha**2
        own = np.log(np.mean(energy / variance, axis=1))
        return float(np.mean(own)) + float(np.log(variance).mean())

    reason = f"{_frames(frames)} of {m} coefficients are likeliest here"
    return least(spectrum, unlikely, Told("likelihood", reason, "−2 log likelihood per row"))


def discrepancy(spectrum: Spectrum, evidence: Evidence) -> AlphaChoice:
    """The alpha whose residual is as large as the noise, Σ r²w = Σ noise²w (Morozov 1966).

    Needs frames and noise. Raises ModelError when no alpha gives such a residual.
    """
    frames = evidence.touched(len(spectrum.values))
    noise = evidence.known_noise(len(spectrum.values))
    level = float(np.sqrt(np.sum(noise**2 * spectrum.problem.weights)))

    def excess(alpha: float) -> float:
        return float(np.sqrt(np.mean(spectrum.residual(alpha, frames) ** 2))) / level

    hints = (
        "the model does not explain these frames to within their noise; choose another rule",
        "there is hardly more than noise in these frames; give some with touches",
    )
    reason = f"the residual of {_frames(frames)} is as large as the noise"
    told = Told("discrepancy", reason, "residual / noise")
    return crossing(spectrum, excess, Level(1.0, "rising", hints), told)


def _frames(frames: FloatArray) -> str:
    return "1 frame" if len(frames) == 1 else f"{len(frames)} frames"
