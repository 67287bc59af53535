"""One look for all figures: colours that everyone can tell apart, maps with their electrodes."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from tomoskin.core import AMOUNT, CHANGE, Detection, FloatArray, IntArray
from tomoskin.model.mesh import Mesh

BLUE, ORANGE, GREEN, PALE = "#0072B2", "#D55E00", "#009E73", "#56B4E9"
"""Okabe and Ito's colours."""

MAP = CHANGE.colormap()
"""Of a change, as the page has it: a fall blue, a rise red."""

AMOUNTS = AMOUNT.colormap()
"""Of what has no sign: pale where there is least."""

MM, UV, MV, MS = 1e3, 1e6, 1e3, 1e3
"""From SI to what the axes say: mm, µV, mV, mS."""

mpl.rcParams.update({
    "font.size": 8,
    "axes.titlesize": 9,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "legend.frameon": False,
    "figure.constrained_layout.use": True,
})  # fmt: skip


def figure(
    rows: int, columns: int, size: tuple[float, float], **options: Any
) -> tuple[Figure, Any]:
    """A figure of ``size`` inches and its axes, (rows, columns)."""
    made = Figure(figsize=size)
    FigureCanvasAgg(made)
    return made, made.subplots(rows, columns, squeeze=False, **options)


def places(n: int) -> FloatArray:
    """(n·n,) where the bars of n groups of n stand: a gap of two between the groups."""
    return (np.arange(n)[:, None] * (n + 2) + np.arange(n)).ravel()


def groups(ax: Axes, n: int) -> None:
    """Name groups of ``n`` bars, one for each grounded electrode, along x."""
    ax.set_xticks(places(n).reshape(n, n).mean(axis=1), [f"E{k + 1}" for k in range(n)])
    ax.tick_params(axis="x", length=0)
    ax.set_xlabel("grounded electrode; in each group the pairs E1–E2, E2–E3, … E8–E1")
    ax.set_xlim(-2, n * (n + 2))
    ax.axhline(0.0, color="0.4", linewidth=0.6)


def shade(ax: Axes, n: int, grounds: Sequence[int]) -> None:
    """Grey behind some of the groups."""
    for ground in grounds:
        first = ground * (n + 2)
        ax.axvspan(first - 1.5, first + n + 0.5, color="0.93", zorder=0, linewidth=0)


def draw_map(ax: Axes, mesh: Mesh, values: FloatArray, limit: float) -> Any:
    """A picture per cell with the electrodes around it; returns what a colour bar needs."""
    x, y = MM * mesh.points.T
    drawn = ax.tripcolor(
        x, y, mesh.cells, facecolors=values, cmap=MAP, vmin=-limit, vmax=limit, rasterized=True
    )
    draw_electrodes(ax, mesh)
    return drawn


def draw_electrodes(ax: Axes, mesh: Mesh) -> None:
    """The electrodes with their names, and what all maps share."""
    for number, facets in enumerate(mesh.electrodes, start=1):
        middle = MM * mesh.points[np.unique(facets)].mean(axis=0)
        ax.plot(*middle, "s", color="0.2", markersize=3)
        ax.annotate(f"E{number}", 1.16 * middle, ha="center", va="center", fontsize=7, color="0.3")
    ax.set_aspect("equal")
    ax.margins(0.15)
    ax.set_xlabel("x / mm")


def mark_region(ax: Axes, mesh: Mesh, reading: Detection, colour: str = "black") -> None:
    """The contour and the centre of a found region."""
    for first, second in MM * mesh.points[_rim(mesh, reading.cells)]:
        ax.plot(*np.transpose([first, second]), color=colour, linewidth=1.2)
    ax.plot(MM * reading.x, MM * reading.y, "+", color=colour, markersize=8, markeredgewidth=1.4)


def mark_probe(ax: Axes, corners: FloatArray) -> None:
    """Where the probe really was: its outline ``corners`` (n, 2) m, dashed."""
    closed = MM * np.vstack([corners, corners[:1]])
    ax.plot(*closed.T, color="0.1", linewidth=0.9, linestyle="--")


def circle(x: float, y: float, radius: float) -> FloatArray:
    """(64, 2) m around a circle."""
    turn = np.linspace(0, 2 * np.pi, 64, endpoint=False)
    return np.column_stack([x + radius * np.cos(turn), y + radius * np.sin(turn)])


def square(x: float, y: float, side: float) -> FloatArray:
    """(4, 2) m corners of a square."""
    return np.array([x, y]) + side / 2 * np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]])


def letters(axes: Sequence[Axes]) -> None:
    """(a), (b), … before the titles."""
    for number, ax in enumerate(axes):
        ax.set_title(f"({chr(ord('a') + number)}) {ax.get_title()}")


def _rim(mesh: Mesh, cells: IntArray) -> IntArray:
    """(n, 2) points of the edges that only one of ``cells`` has."""
    corners = mesh.cells[cells]
    edges = np.sort(
        np.concatenate([corners[:, [0, 1]], corners[:, [1, 2]], corners[:, [2, 0]]]), axis=1
    )
    unique, count = np.unique(edges, axis=0, return_counts=True)
    return unique[count == 1]


def colour_bar(made: Figure, drawn: Any, axes: Any) -> None:
    """The scale of all maps of a figure."""
    made.colorbar(drawn, ax=axes, label="change of conductivity / mS", shrink=0.7, pad=0.01)
