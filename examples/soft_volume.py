"""A soft block that conducts: where it is touched, and where something lies inside it.

A cylinder of conductive silicone, 100 mm across and 40 mm high, with two rings of eight electrodes
on its wall. First an insulating ball of 20 mm is cast in: the change against a block without it
gives its place in space. Then a finger indents the top of that block by 5 mm. Silicone keeps its
volume, so the whole block deforms and its electrodes move with the wall. The change against the
untouched block gives the place of the touch.

Shown: level and upright cuts through each picture; dashed is the truth, the cross what was found.
Thesis saw: nothing of the kind; it hopes for soft bodies that sense by themselves (chapter 8).
Checked: the ball within 8 mm in space, the touch within 6 mm on the surface.
Assumed: a silicone of 1 S/m that keeps its conductivity when it is deformed, the same noise on each
row, and a dent of a known shape. A filled silicone changes by itself when it is stretched: then the
touch would be seen better or worse, and the place has not been tried.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from matplotlib.figure import Figure
from scipy.spatial import cKDTree

import figures
from bodies import options_of
from lab import report
from tomoskin.core import FloatArray
from tomoskin.imaging import OneStep, Operator
from tomoskin.model.forward import ForwardModel
from tomoskin.model.mesh import Disc, Mesh, extrude, ring
from tomoskin.model.pattern import named
from tomoskin.model.prior import Matern

RADIUS, HEIGHT = 50e-3, 40e-3
WALL = Disc(RADIUS)
PATCHES = (*ring(WALL, 8, 8e-3, 6e-3, 14e-3), *ring(WALL, 8, 8e-3, 26e-3, 34e-3))
PATTERN = named("adjacent+opposite", 16)
"""Neighbours in a ring, and each electrode with the one above it."""

SILICONE, INSULATOR, CONTACT = 1.0, 0.01, 1e-3
"""S/m, S/m and Ω·m²; a silicone filled with carbon, assumed."""

CURRENT, NOISE, MISFIT = 10e-3, 50e-6, 1e-3
"""A; V of a row; and what the model does not explain, in parts of the voltage."""

BALL, BALL_RADIUS = np.array([16e-3, -10e-3, 18e-3]), 10e-3
TOUCH, DEPTH, FINGER = np.array([-18e-3, 14e-3]), 5e-3, 8e-3
"""Places of both in m; depth of the dent and its width (of a Gaussian)."""


def body(cells: int, layers: int, seed: int) -> Mesh:
    """The block, of about so many ``layers`` over about ``cells`` flat triangles."""
    return extrude(WALL, HEIGHT, PATCHES, cells=cells, layers=layers, seed=seed)


def indented(points: FloatArray, place: FloatArray) -> FloatArray:
    """(n, 3) m where ``points`` (n, 3) m of the block come to lie under a finger.

    Down by d·g(r)·z/H for a dent g = exp(−r²/2s²), and outwards by d s²(1 − g)/(H r): so no
    volume is lost, to first order, and the bottom slips on the table.
    """
    away = points[:, :2] - place
    square = (away**2).sum(axis=1)
    dent = np.exp(-square / (2 * FINGER**2))
    out = -np.expm1(-square / (2 * FINGER**2)) / np.maximum(square, 1e-12)
    moved = points.copy()
    moved[:, :2] += DEPTH * FINGER**2 / HEIGHT * out[:, None] * away
    moved[:, 2] -= DEPTH * dent * points[:, 2] / HEIGHT
    return moved


def with_ball(mesh: Mesh) -> FloatArray:
    """(n_cells,) S/m of the block with a ball in it."""
    inside = np.linalg.norm(mesh.centroids - BALL, axis=1) < BALL_RADIUS
    return np.where(inside, INSULATOR, SILICONE)


def measured(seed: int) -> tuple[FloatArray, FloatArray, FloatArray]:
    """(n_meas,) V of the block alone, with the ball in it, and that touched."""
    mesh = body(1500, 10, seed=5)
    sigma = with_ball(mesh)
    touched = replace(mesh, points=indented(mesh.points, TOUCH))
    random = np.random.default_rng(seed)
    plain, ball, both = (
        ForwardModel(one, PATTERN, CONTACT, CURRENT).solve(values).voltages
        + NOISE * random.standard_normal(PATTERN.n_meas)
        for one, values in ((mesh, SILICONE), (mesh, sigma), (touched, sigma))
    )
    return plain, ball, both


def imaging() -> Operator:
    """One step on a coarser mesh: a smooth change, alike over 12 mm."""
    model = ForwardModel(body(400, 7, seed=1), PATTERN, CONTACT, CURRENT)
    size = np.abs(model.solve(SILICONE).voltages)
    weights = 1 / (2 * NOISE**2 + (MISFIT * size) ** 2)
    return OneStep(model, Matern(12e-3), alpha=1 / (0.2 * SILICONE), weights=weights)


def centre(mesh: Mesh, values: FloatArray) -> FloatArray:
    """(3,) m, centroid of what is below half the minimum of ``values`` (n_cells,)."""
    share = np.where(values < values.min() / 2, -values, 0.0) * mesh.volumes
    return np.asarray(share @ mesh.centroids / share.sum())


def main(arguments: Sequence[str] | None = None) -> dict[str, float]:
    """Measure, find, draw; the numbers that were checked."""
    options = options_of("soft_volume", arguments, __doc__)
    plain, ball, both = measured(options.seed)
    operator = imaging()
    mesh = operator.model.mesh
    inside, touched = operator(ball - plain).values, operator(both - ball).values
    found, place = centre(mesh, inside), centre(mesh, touched)
    away = float(np.linalg.norm(found - BALL))
    beside = float(np.linalg.norm(place[:2] - TOUCH))
    numbers = {"error of the ball, mm": 1e3 * away, "error of the touch, mm": 1e3 * beside}
    assert away < 8e-3, f"the ball is placed {1e3 * away:.1f} mm off"
    assert beside < 6e-3, f"the touch is placed {1e3 * beside:.1f} mm off"
    options.figure.save(draw(mesh, inside, touched, found, place))
    return numbers


def draw(
    mesh: Mesh, inside: FloatArray, touched: FloatArray, found: FloatArray, place: FloatArray
) -> Figure:
    """Cuts through both pictures, level and upright; truth dashed, places found as crosses."""
    made, axes = figures.figure(2, 2, (7.2, 4.6), height_ratios=(5, 2), sharex=True)
    turn = np.linspace(0, 2 * np.pi, 60)
    ring_of = BALL_RADIUS * np.column_stack([np.cos(turn), np.sin(turn)])
    finger = FINGER * np.column_stack([np.cos(turn), np.sin(turn)])
    dent = np.column_stack([TOUCH[0] + FINGER * np.array([-1, 1]), [HEIGHT, HEIGHT]])
    columns = (
        ("the ball", inside, BALL, found, BALL[:2] + ring_of, BALL[[0, 2]] + ring_of),
        ("the touch", touched, (*TOUCH, HEIGHT - 3e-3), place, TOUCH + finger, dent),
    )
    for column, (name, values, at, where, level, upright) in enumerate(columns):
        limit = float(np.abs(values).max())
        for row, (plane, outline) in enumerate((((0, 1), level), ((0, 2), upright))):
            ax = axes[row, column]
            x, y, shown = cut(mesh, values, np.asarray(at), plane)
            drawn = ax.pcolormesh(
                figures.MM * x, figures.MM * y, shown,
                cmap=figures.MAP, vmin=-limit, vmax=limit, rasterized=True,
            )  # fmt: skip
            ax.plot(*(figures.MM * outline.T), "--", color="0.2", linewidth=1)
            ax.plot(*(figures.MM * where[list(plane)]), "k+", markersize=9)
            ax.set_aspect("equal")
        axes[0, column].set_title(name)
        axes[1, column].set_xlabel("x / mm")
        made.colorbar(drawn, ax=axes[:, column], label="change of conductivity / S/m", shrink=0.7)
    axes[0, 0].set_ylabel("y / mm")
    axes[1, 0].set_ylabel("z / mm")
    figures.letters(axes[0])
    return made


def cut(
    mesh: Mesh, values: FloatArray, at: FloatArray, plane: tuple[int, int]
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Places along two axes, m, and the nearest cells' values on the plane through ``at``."""
    x = np.linspace(-RADIUS, RADIUS, 161)
    y = x if plane[1] == 1 else np.linspace(0.0, HEIGHT, 65)
    points = np.tile(np.asarray(at, dtype=float), (len(y), len(x), 1))
    points[..., plane[0]], points[..., plane[1]] = np.meshgrid(x, y)
    shown = values[cKDTree(mesh.centroids).query(points)[1]]
    inside = np.hypot(points[..., 0], points[..., 1]) <= RADIUS
    return x, y, np.where(inside, shown, np.nan)


if __name__ == "__main__":
    report(main())
