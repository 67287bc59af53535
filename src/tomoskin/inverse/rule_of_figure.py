"""The rule of the noise figure: the image keeps a stated part of the data's signal to noise."""

from __future__ import annotations

import numpy as np

from tomoskin.core import FloatArray
from tomoskin.inverse.choice import AlphaChoice, Evidence
from tomoskin.inverse.noise_figure import noise_figure
from tomoskin.inverse.search import Level, Told, crossing
from tomoskin.inverse.spectrum import Spectrum

TARGET = 1.0
"""Noise figure that is aimed at (Adler & Guardo 1996)."""

WIDTH = 0.1
"""Radius of the contrast in the middle, in parts of the mesh's largest extent."""


def noise_figure_rule(
    spectrum: Spectrum, evidence: Evidence, target: float = TARGET
) -> AlphaChoice:
    """The alpha whose noise figure is ``target``, for a contrast in the middle of the mesh.

    The noise's size does not count, only how it is spread over the rows: all alike where the
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

    reason = f"the noise figure is {target:g} for a contrast in the middle"
    hints = (
        "aim at a larger noise figure, or choose another rule",
        "aim at a smaller noise figure, or choose another rule",
    )
    told = Told("noise-figure", reason, "noise figure")
    return crossing(spectrum, figure, Level(target, "falling", hints), told)


def in_the_middle(spectrum: Spectrum) -> FloatArray:
    """(n_cells,) 1 within :data:`WIDTH` of the mesh's middle (one cell at least), else 0."""
    mesh = spectrum.problem.model.mesh
    middle = mesh.volumes @ mesh.centroids / mesh.volumes.sum()
    distance = np.linalg.norm(mesh.centroids - middle, axis=1)
    reach = max(WIDTH * float(np.ptp(mesh.points, axis=0).max()), float(distance.min()))
    return np.asarray(distance <= reach, dtype=np.float64)
