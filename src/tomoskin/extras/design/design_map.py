"""The map of what a skin can resolve."""

from __future__ import annotations

from typing import Any

import numpy as np

from tomoskin.core import AMOUNT, FloatArray, StrPath
from tomoskin.extras.design.bounds import ResolutionBounds
from tomoskin.files.exports import new_figure, save_figure
from tomoskin.model.skin import Skin

_MM = 1e3
_LEVELS = (0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0)
"""Of the contours: mm, and per cent."""

_TICKS = (*_LEVELS, 0.3, 0.7, 1.5, 3.0, 4.0, 7.0, 15.0, 30.0, 70.0)


def write_promise(
    path: StrPath, skin: Skin, bounds: ResolutionBounds, title: str, *, overwrite: bool = False
) -> None:
    """Draw both maps side by side, with the electrodes and, within 85 % of the way out, contours.

    Raises
    ------
    DataError
        When matplotlib is not installed, and as :func:`written` does.
    """
    figure = new_figure(path, 11.0, 4.7)
    place_axes, press_axes = figure.subplots(1, 2)
    maps = (
        (place_axes, _MM * bounds.rms, "least RMS error of the position (mm)"),
        (
            press_axes,
            100 * bounds.faintest,
            "faintest press that is detected (% of the conductivity)",
        ),
    )
    for ax, values, label in maps:
        drawn = _draw_map(ax, skin, bounds, values)
        ends = drawn.get_clim()
        ticks = [level for level in _TICKS if ends[0] <= level <= ends[1]]
        bar = figure.colorbar(drawn, ax=ax, shrink=0.9, extend="both", ticks=ticks, format="%g")
        bar.set_label(label, fontsize=9)
        bar.ax.tick_params(labelsize=8)
        bar.ax.minorticks_off()
    figure.suptitle(title, fontsize=10)
    save_figure(path, figure, overwrite=overwrite)


def _draw_map(ax: Any, skin: Skin, bounds: ResolutionBounds, values: FloatArray) -> Any:
    finite = np.where(np.isfinite(values), values, 1e6)
    low, high = np.percentile(finite[bounds.inside], (2, 98))
    ends = {"vmin": low / 1.2, "vmax": max(high, 1.5 * low) * 1.2}
    x, y = _MM * bounds.mesh.points.T
    drawn = ax.tripcolor(
        x, y, bounds.mesh.cells, facecolors=finite, cmap=AMOUNT.colormap(), norm="log", **ends
    )
    middle, within = _MM * bounds.mesh.centroids[bounds.inside], finite[bounds.inside]
    shown = [level for level in _LEVELS if within.min() < level < within.max()]
    if shown:
        lines = ax.tricontour(*middle.T, within, levels=shown, colors="black", linewidths=0.8)
        ax.clabel(lines, fmt="%g", fontsize=7)
    for number, arc in enumerate(skin.arcs, start=1):
        along = np.linspace(arc.start, arc.start + arc.width(skin.outline), 9)
        ax.plot(*(_MM * skin.outline.point(along % skin.outline.length)).T, color="black", lw=3)
        place = 1.08 * _MM * skin.electrode_centres[number - 1]
        ax.text(*place, f"E{number}", fontsize=7, ha="center", va="center", color="0.25")
    ax.set_aspect("equal")
    ax.set_xlabel("mm", fontsize=8)
    ax.tick_params(labelsize=7)
    ax.margins(0.1)
    return drawn
