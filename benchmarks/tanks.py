"""Scores and certainty in simulated tanks of the Kuopio challenge."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.path import Path as Polygon
from numpy.typing import NDArray
from scipy.ndimage import binary_dilation
from scipy.stats import rankdata

from bench_rig import load_example
from report import Report, recordings, table
from tomoskin.core import FloatArray
from tomoskin.model.forward import ForwardModel
from tomoskin.model.mesh import Disc, ElectrodeArc, triangulate

RADIUS, PIXELS, CELLS = 0.115, 256, 9000
WIDTHS = (0.0115, 0.0125, 0.0135)
"""Widths that the electrodes may have, m; the method takes the middle one."""

GAP, RIM, SMALLEST = 6, 0.108, 400
"""Pixels between targets, the circle that holds them, m, and the smallest, pixels."""


def simulated(example: Any, seed: int, inj: FloatArray, mpat: FloatArray) -> Any:
    """A sample with one to four targets, its own contacts, channels and change of the water."""
    rng = np.random.default_rng(seed)
    truth = targets(rng)
    model = _model(example, float(rng.choice(WIDTHS)))
    model = ForwardModel(
        model.mesh, model.pattern, np.exp(rng.normal(np.log(3e-4), 0.9, 32)), model.current
    )
    readout = example.Readout(inj, mpat, np.ones(inj.shape[1] * mpat.shape[1], bool))
    rows = readout.rows(rng.normal(0.0, 0.012, mpat.shape[1]))
    water = 0.73
    drifted, plastic = water * np.exp(rng.normal(0.0, 0.03)), 0.004
    metal = np.exp(rng.uniform(np.log(8.0), np.log(300.0)))
    sigma = _mixed(model, truth, np.array([drifted, plastic, metal]))
    u_ref = rows @ model.solve(water).voltages
    change = rows @ model.solve(sigma).voltages - u_ref
    n, touched = len(change), readout.touched
    u_ref += rng.normal(0.0, 0.004, n) + touched * rng.normal(0.0, 0.02, n)
    change *= 1.0 + 0.025 * rng.standard_normal(n)
    change += 3e-4 * rng.standard_normal(n) + touched * rng.normal(0.0, 0.01, n)
    shape = (inj.shape[1], mpat.shape[1])
    gain = (1 + 0.01 * rng.standard_normal((shape[0], 1))) * (
        1 + 0.01 * rng.standard_normal(shape[1])
    )
    return example.Sample(str(seed), u_ref + change * gain.ravel(), u_ref, inj, mpat, truth)


def targets(rng: np.random.Generator) -> NDArray[np.uint8]:
    """Labels (256, 256) of one to four targets that do not touch; row 0 at the top."""
    labels = np.zeros(PIXELS * PIXELS, np.uint8)
    taken = np.zeros(PIXELS * PIXELS, bool)
    wanted, one_kind = rng.choice([1, 2, 3, 4], p=[0.15, 0.35, 0.3, 0.2]), rng.random() < 0.15
    kind, places = rng.integers(1, 3), _pixels()
    for _ in range(60):
        inside, turn, away = shape(rng), rng.uniform(0, 2 * np.pi), rng.uniform(0, 2 * np.pi)
        centre = 0.1 * np.sqrt(rng.random()) * np.array([np.cos(away), np.sin(away)])
        turned = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
        mine = inside((places - centre) @ turned)
        outside = np.hypot(*places[mine].T) > RIM
        if mine.sum() < SMALLEST or outside.any() or (mine & taken).any():
            continue
        labels[mine] = kind if one_kind else rng.integers(1, 3)
        taken = binary_dilation((labels > 0).reshape(PIXELS, PIXELS), iterations=GAP).ravel()
        wanted -= 1
        if not wanted:
            break
    return labels.reshape(PIXELS, PIXELS)


def shape(rng: np.random.Generator) -> Callable[[FloatArray], NDArray[np.bool_]]:
    """A disc, ellipse, rectangle, triangle, polygon, cross, L or C, 28 to 100 mm across."""
    r, kind = rng.uniform(0.014, 0.042), rng.integers(8)
    ratio, thick, long = rng.uniform(0.4, 1.0), r * rng.uniform(0.3, 0.45), 1.25 * r
    if kind <= 1:
        return lambda q: np.hypot(q[:, 0], q[:, 1] / (1.0 if kind == 0 else ratio)) < r
    if kind == 2:
        return lambda q: np.asarray((np.abs(q) < 0.9 * r * np.array([1.0, ratio])).all(axis=1))
    if kind <= 4:
        n = 3 if kind == 3 else int(rng.integers(4, 7))
        at = np.arange(n) * 2 * np.pi / n + rng.uniform(-0.3, 0.3, n)
        reach = 1.1 * r * rng.uniform(0.75, 1.15, (n, 1))
        return Polygon(reach * np.column_stack([np.cos(at), np.sin(at)])).contains_points
    if kind == 5:
        side = np.array([thick, long])
        return lambda q: np.asarray((np.sort(np.abs(q), axis=1) < side).all(axis=1))
    if kind == 6:
        return lambda q: (np.abs(q) < long).all(axis=1) & (q.min(axis=1) < 2 * thick - long)
    return lambda q: (
        (np.abs(np.hypot(*q.T) - long + 0.8 * thick) < 0.8 * thick)
        & ~((q[:, 0] > 0) & (np.abs(q[:, 1]) < 0.6 * r))
    )


@cache
def _pixels() -> FloatArray:
    step = RADIUS * ((np.arange(PIXELS) + 0.5) / PIXELS * 2 - 1)
    x, y = np.meshgrid(step, -step)
    return np.column_stack([x.ravel(), y.ravel()])


@cache
def _model(example: Any, width: float) -> ForwardModel:
    """On a mesh of its own, of 1 A, as the example's is."""
    rim = Disc(RADIUS)
    arcs = [ElectrodeArc.around((0.25 + k / 32) * rim.length, width) for k in range(32)]
    return ForwardModel(triangulate(rim, arcs, CELLS, seed=5), example.resistances(), 1e-4)


def _mixed(model: ForwardModel, truth: NDArray[np.uint8], values: FloatArray) -> FloatArray:
    """Conductivity of each cell, by the mean reflection at four points in it."""
    inner = np.array([[0.6, 0.2, 0.2], [0.2, 0.6, 0.2], [0.2, 0.2, 0.6], [1 / 3, 1 / 3, 1 / 3]])
    points = np.einsum("wk,nkd->nwd", inner, model.mesh.points[model.mesh.cells]) / RADIUS
    row = ((1 - points[..., 1]) * PIXELS / 2).astype(int)
    column = ((1 + points[..., 0]) * PIXELS / 2).astype(int)
    found = values[truth[row, column]]
    water = values[0]
    reflection = ((found - water) / (found + water)).mean(axis=1)
    return np.asarray(water * (1 + reflection) / (1 - reflection))


LEVELS, TANKS = range(1, 8), 21
"""Each level has tanks of its own; settings were chosen on others."""

COARSE = 64
"""Pixels a side where certainty is judged."""

FIGURES = ("score", "wrong", "ranked", "loss, bits", "constant, bits")


def run(data: Path | None) -> Iterator[Report]:
    """Segment tanks at every level; ``data`` is the folder of public recordings."""
    file = Path("ktc2023_tank32") / "train.npz"
    example = load_example("ktc2023")
    real = next(iter(example.samples(recordings(data, str(file)) / file)))
    every = np.array([_level(example, level, real) for level in LEVELS])
    mean, error = every.mean(axis=1), every[:, :, 0].std(axis=1, ddof=1) / np.sqrt(TANKS)
    texts = [[f"{value:.3f}" for value in row] for row in mean.T]
    texts[0] = [f"{text} ± {e:.3f}" for text, e in zip(texts[0], error, strict=True)]
    levels = [f"level {level}" for level in LEVELS]
    yield table(
        f"{TANKS} simulated tanks of the Kuopio challenge",
        (
            {"": what} | dict(zip(levels, t, strict=True))
            for what, t in zip(FIGURES, texts, strict=True)
        ),
        "score: 1 is best; ±: standard error of the mean over tanks; wrong: part of the pixels",
        "ranked: how often a wrong pixel is less sure than a right one; 0.5 is chance",
        "loss: mean of −log₂ of the probability given to the true label",
        "constant: the same if every label counted as wrong as often as labels are",
    )


def _level(example: Any, level: int, real: Any) -> list[tuple[float, ...]]:
    seeds = range(6000 + 100 * level, 6000 + 100 * level + TANKS)
    tanks = (simulated(example, seed, real.inj, real.mpat) for seed in seeds)
    return [judged(example, tank, level) for tank in tanks]


def judged(example: Any, tank: Any, level: int) -> tuple[float, ...]:
    """FIGURES of a tank, segmented without the electrodes that ``level`` leaves out."""
    keep = example.kept(tank.inj, tank.mpat, level)
    found = example.regions(*example.checked(tank.u, tank.u_ref, tank.inj, tank.mpat, keep))
    score = example.score(example.labelled(found), tank.truth)
    points, inside = example.pixels(COARSE)
    step = example.PIXELS // COARSE
    truth = np.asarray(tank.truth)[step // 2 :: step, step // 2 :: step][inside]
    wrong = found.at(points) != truth
    rank, n = rankdata(found.entropy(points)), int(wrong.sum())
    above = rank[wrong].sum() - n * (n + 1) / 2
    given = found.probability(points)[np.arange(len(truth)), truth]
    often = (n + 1) / (len(truth) + 2)
    constant = -often * np.log2(often / 2) - (1 - often) * np.log2(1 - often)
    ranked = above / (n * (len(truth) - n)) if n else 1.0
    return score, wrong.mean(), ranked, -np.log2(given + 1e-3).mean(), constant
