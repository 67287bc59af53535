"""Simulated tanks of the Kuopio challenge: random targets, another mesh, faults as measured."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache

import numpy as np
from matplotlib.path import Path as Polygon
from numpy.typing import NDArray
from scipy.ndimage import binary_dilation

from tomoskin.core import FloatArray
from tomoskin.model.forward import ForwardModel
from tomoskin.model.mesh import Disc, ElectrodeArc, triangulate
from tomoskin.model.pattern import Pattern

RADIUS, PIXELS, CELLS = 0.115, 256, 9000
WIDTHS = (0.0115, 0.0125, 0.0135)
"""Widths that the electrodes may have, m; the method takes the middle one."""

GAP, RIM, SMALLEST = 6, 0.108, 400
"""Pixels between targets, the circle that holds them, m, and the smallest, pixels."""

Inside = Callable[[FloatArray], NDArray[np.bool_]]


@dataclass(frozen=True, eq=False)
class Tank:
    """What was in it, (256, 256), and what was measured, (rows,) V."""

    truth: NDArray[np.uint8]
    u: FloatArray
    u_ref: FloatArray


def simulated(seed: int, inj: FloatArray, mpat: FloatArray) -> Tank:
    """A tank with one to four targets, its own contacts, channels and change of the water."""
    rng = np.random.default_rng(seed)
    truth = targets(rng)
    model = _model(float(rng.choice(WIDTHS)), inj, mpat)
    model = ForwardModel(
        model.mesh, model.pattern, np.exp(rng.normal(np.log(3e-4), 0.9, 32)), model.current
    )
    leak = np.asarray(rng.normal(0.0, 0.012, mpat.shape[1]))
    water = 0.73
    drifted, plastic = water * np.exp(rng.normal(0.0, 0.03)), 0.004
    metal = np.exp(rng.uniform(np.log(8.0), np.log(300.0)))
    sigma = _mixed(model, truth, np.array([drifted, plastic, metal]))
    u_ref, change = _read(model, water, inj, mpat, leak), _read(model, sigma, inj, mpat, leak)
    change -= u_ref
    touched = ((inj != 0).T @ (mpat != 0)).ravel()
    n = len(change)
    u_ref += rng.normal(0.0, 0.004, n) + touched * rng.normal(0.0, 0.02, n)
    change *= 1.0 + 0.025 * rng.standard_normal(n)
    change += 3e-4 * rng.standard_normal(n) + touched * rng.normal(0.0, 0.01, n)
    shape = (inj.shape[1], mpat.shape[1])
    gain = (1 + 0.01 * rng.standard_normal((shape[0], 1))) * (
        1 + 0.01 * rng.standard_normal(shape[1])
    )
    return Tank(truth, u_ref + change * gain.ravel(), u_ref)


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


def shape(rng: np.random.Generator) -> Inside:
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


_MODELS: dict[float, ForwardModel] = {}


def _model(width: float, inj: FloatArray, mpat: FloatArray) -> ForwardModel:
    if width not in _MODELS:
        rim = Disc(RADIUS)
        arcs = [ElectrodeArc.around((0.25 + k / 32) * rim.length, width) for k in range(32)]
        drives = np.column_stack([inj.argmax(axis=0), inj.argmin(axis=0)])
        pairs = np.column_stack([mpat.argmax(axis=0), mpat.argmin(axis=0)])
        unique = np.unique(np.sort(drives, axis=1), axis=0)
        pattern = Pattern.from_pairs(32, unique, pairs, include_driven=True)
        mesh = triangulate(rim, arcs, CELLS, seed=5)
        _MODELS[width] = ForwardModel(mesh, pattern, 1e-4)
    return _MODELS[width]


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


def _read(
    model: ForwardModel,
    sigma: float | FloatArray,
    inj: FloatArray,
    mpat: FloatArray,
    leak: FloatArray,
) -> FloatArray:
    """(rows,) V: differences of potentials, and a part of the common voltage over the sink's."""
    at = inj.T @ model.transfer_resistance(sigma)
    sink = np.take_along_axis(at, inj.argmin(axis=0)[:, None], axis=1)
    return np.asarray((at @ mpat + leak * (at @ (np.abs(mpat) / 2) - sink)).ravel())
