"""Choice of alpha: another operator from the spectrum, each rule, and a frame that waits for it."""

from __future__ import annotations

import contextlib
from collections.abc import Callable
from functools import partial
from pathlib import Path

import numpy as np

from forward_cases import clock, medians
from forward_tables import Promise, cell, promises
from report import Report
from tomoskin.core import ModelError
from tomoskin.imaging import RULES, Evidence, LightTouch, Spectrum, choose
from tomoskin.model.skin import Skin
from tomoskin.pipeline import Prepared, prepare
from tomoskin.pipeline.tune import tune
from tomoskin.sensing.signal import Reference

CELLS = (660, 3000)
SECONDS = 2.0
ALPHA = 0.05
FRAMES = 50
"""Frames that the rules look at."""

LOUD = 3.0
"""Noise of the reference, in parts of what the read-out predicts: the operator is made anew."""


def run(data: Path | None) -> tuple[Report, ...]:
    """Time every case; ``data`` is not needed."""
    del data
    skins = [Skin.load("textile-disc-16").altered({"mesh": {"cells": n}}) for n in CELLS]
    prepared = [prepare(skin.altered({"inverse": {"alpha": "auto"}})) for skin in skins]
    times = [medians(_calls(p), SECONDS, least=3) for p in prepared]
    waits = [max(_waits(p)) for p in prepared]
    rows = [(name, *(cell(1e3 * t[name]) for t in times)) for name in times[0] if name not in RULES]
    rows.append(("longest wait of a frame while the operator changes", *_ms(waits)))
    chosen = [(f"rule {name}", *(cell(1e3 * t[name]) for t in times)) for name in RULES]
    table = Report(
        "alpha: 16 electrodes, 208 rows",
        ("ms", *(f"{len(p.mesh.cells):,} triangles" for p in prepared)),
        (*rows, *chosen),
        (
            f"medians of {clock()[1]}; rules look at {FRAMES} frames of a touched model",
            "longest wait: the most that any one frame of the swap does, floor of noise included",
        ),
    )
    slider: Promise = ("another alpha at 3k, ms", 1e3 * times[1]["operator"], 150.0, False)
    return table, promises([slider])


def _ms(values: list[float]) -> list[str]:
    return [cell(1e3 * value) for value in values]


def _calls(prepared: Prepared) -> dict[str, Callable[[], object]]:
    spectrum = Spectrum.of(prepared.problem)
    touch, evidence = LightTouch.of(spectrum), _evidence(prepared)
    noise = prepared.predicted_noise()
    calls: dict[str, Callable[[], object]] = {
        "spectrum": lambda: Spectrum.of(prepared.problem),
        "light touches": lambda: LightTouch.of(spectrum),
        "operator": lambda: spectrum.operator(ALPHA),
        "operator without a spectrum": lambda: prepared.problem.operator(ALPHA),
        "choice for another noise": lambda: touch(noise),
    }
    for rule in RULES:
        calls[rule] = partial(_tried, spectrum, rule, evidence)
    return calls


def _tried(spectrum: Spectrum, rule: str, evidence: Evidence) -> None:
    with contextlib.suppress(ModelError):  # the L-curve of such frames may have no corner
        choose(spectrum, rule, evidence)


def _evidence(prepared: Prepared) -> Evidence:
    """Round touches all over the sheet, on the linear model, with the predicted noise."""
    rng, centroids = np.random.default_rng(0), prepared.mesh.centroids
    radius, angle = 0.07 * np.sqrt(rng.uniform(0, 1, FRAMES)), rng.uniform(0, 2 * np.pi, FRAMES)
    places = np.column_stack([radius * np.cos(angle), radius * np.sin(angle)])
    near = np.linalg.norm(centroids[:, None] - places, axis=2) < 0.015
    change = np.where(near, -0.2 * prepared.skin.conductivity, 0.0)
    noise = prepared.predicted_noise()
    frames = (prepared.problem.jacobian @ change).T
    frames += noise * rng.standard_normal(frames.shape)
    return Evidence(noise, frames, places, prepared.positions)


def _waits(prepared: Prepared) -> list[float]:
    """Seconds of each step of a change of operator, and of the floor after it."""
    rng, now = np.random.default_rng(1), clock()[0]
    mean = prepared.operator.reference
    reference = Reference.of(
        mean + LOUD * prepared.readout.noise * rng.standard_normal((20, len(mean)))
    )
    steps, taken, found = tune(prepared, reference), [], prepared
    while found is prepared:
        began = now()
        try:
            next(steps)
        except StopIteration as end:
            found = end.value
            found.image_noise(reference)
        taken.append(now() - began)
    return taken
