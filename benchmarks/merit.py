"""GREIT's figures of merit: the trained operator against NOSER at equal noise figure."""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
from scipy.optimize import brentq

from report import Report
from tomoskin.imaging import (
    Greit,
    LinearProblem,
    Merit,
    Modes,
    OneStep,
    Spectrum,
    Targets,
    Temporal,
    along,
    figures,
    noise_figure,
)
from tomoskin.model.forward import ForwardModel
from tomoskin.model.skin import Skin

SKINS = ("textile-disc-8", "textile-disc-16", "textile-square-16", "tank-16")
FIGURES = (1.0, 1.5)  # below 1.2 no NOSER of the tank has one
CELLS, TRAINED_ON, TESTED_ON = 900, 3600, 6000


def run(data: Path | None) -> tuple[Report, ...]:
    """Compare on every built-in skin, and time the filter; ``data`` is not needed."""
    del data
    rows = [row for name in SKINS for figure in FIGURES for row in _pair(name, figure)]
    merit = Report(
        "figures of merit, mean over the targets",
        (
            "skin",
            "operator",
            "noise figure",
            "amplitude sd/mean",
            "off mm",
            "resolution",
            "deformation",
            "ringing",
            "made in s",
        ),
        tuple(rows),
        (
            "10 targets from the centre to an electrode, 10 to the middle between two, "
            "radius 2 % of the extent, contrast −10 %",
            f"image {CELLS} cells, training {TRAINED_ON}, test {TESTED_ON}: three meshes",
            "deformation and resolution: Adler et al. 2009; off: distance from the target",
        ),
    )
    return merit, _filters()


def _model(name: str, cells: int) -> ForwardModel:
    skin = Skin.load(name).altered({"mesh": {"cells": cells}})
    return ForwardModel(skin.mesh(), skin.pattern(), skin.contact_impedance, skin.current)


def _targets(name: str, image: ForwardModel) -> Targets:
    skin = Skin.load(name)
    ends = skin.electrode_centres[0], skin.electrode_centres[:2].mean(axis=0)
    places = np.vstack([along(image.mesh, end, 11)[:-1] for end in ends])
    radius = 0.02 * float(np.ptp(image.mesh.points, axis=0).max())
    return Targets.simulate(
        _model(name, TESTED_ON),
        places,
        radius=radius,
        conductivity=skin.conductivity,
        difference=skin.inverse.difference,
    )


def _pair(name: str, figure: float) -> list[tuple[object, ...]]:
    skin, image = Skin.load(name), _model(name, CELLS)
    targets = _targets(name, image)
    start = time.perf_counter()
    greit = Greit(
        image,
        simulated_on=_model(name, TRAINED_ON),
        conductivity=skin.conductivity,
        difference=skin.inverse.difference,
        noise_figure=figure,
    )
    taken = time.perf_counter() - start
    trained = figures(greit, targets)
    start = time.perf_counter()
    spectrum = Spectrum.of(
        LinearProblem.of(
            image, "noser", conductivity=skin.conductivity, difference=skin.inverse.difference
        )
    )
    middle = targets.dv[0]

    def excess(decade: float) -> float:
        matrix = spectrum.operator(10.0**decade).matrix
        return noise_figure(matrix, image.mesh.volumes, middle) - trained.noise_figure

    alpha = _crossing(excess, np.log10(spectrum.alphas))
    if alpha is None:
        return [_row(name, "greit", trained, taken), (name, "noser: no alpha", *(7 * ["-"]))]
    noser = figures(spectrum.operator(alpha), targets)
    spent = time.perf_counter() - start
    return [_row(name, "noser", noser, spent), _row(name, "greit", trained, taken)]


def _crossing(excess: Callable[[float], float], decades: np.ndarray) -> float | None:
    """The alpha at which the noise figure falls to what is asked; far beyond, it rises again."""
    values = [excess(float(decade)) for decade in decades[::8]]
    for i in range(len(values) - 1, 0, -1):
        if values[i] <= 0 < values[i - 1]:
            low, high = float(decades[::8][i - 1]), float(decades[::8][i])
            return float(10.0 ** brentq(excess, low, high, xtol=1e-3))
    return None


def _row(name: str, operator: str, m: Merit, seconds: float) -> tuple[object, ...]:
    spread = float(m.amplitude.std() / m.amplitude.mean())
    figures = (m.resolution, m.deformation, m.ringing)
    return (
        name,
        operator,
        round(m.noise_figure, 2),
        round(spread, 3),
        round(1e3 * float(m.offset.mean()), 2),
        *(round(float(x.mean()), 3) for x in figures),
        round(seconds, 2),
    )


def _filters() -> Report:
    skin = Skin.load("textile-disc-16").altered({"mesh": {"cells": 3000}})
    model = ForwardModel(skin.mesh(), skin.pattern(), skin.contact_impedance, skin.current)
    operator = OneStep(model, alpha=0.1, conductivity=skin.conductivity)
    data = np.random.default_rng(0).normal(0.0, 1e-5, (500, model.pattern.n_meas))
    start = time.perf_counter()
    temporal = Temporal(Modes.of(Spectrum.of(operator.problem), operator.alpha), 0.2)
    made = 1e3 * (time.perf_counter() - start)
    cases = {
        "operator, double": lambda dv, _: operator(dv),
        "operator, single": lambda dv, _: operator.deferred(dv).values,
        "Kalman filter": temporal.push,
    }
    rows = tuple((name, *_times(step, data)) for name, step in cases.items())
    notes = (f"{len(data)} frames; the filter's modes were made in {made:.0f} ms, once",)
    title = f"one frame, {len(model.mesh.cells)} triangles, {model.pattern.n_meas} rows"
    return Report(title, ("step", "p50 ms", "p99 ms"), rows, notes)


def _times(step: Callable[[np.ndarray, float], object], data: np.ndarray) -> tuple[float, float]:
    taken = []
    for number, dv in enumerate(data):
        start = time.perf_counter()
        step(dv, 0.01 * number)
        taken.append(1e3 * (time.perf_counter() - start))
    p50, p99 = np.percentile(taken, (50, 99))
    return round(float(p50), 3), round(float(p99), 3)
