"""Curves and maps of designs: those that alpha was read from with the Picard plot, figures of
merit over distance, and what a skin can resolve."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from tomoskin.core import AMOUNT, FloatArray, StrPath, write_rows
from tomoskin.files.exports.picture import dress, new_figure, panel_axes, save_figure
from tomoskin.imaging import AlphaChoice, Curve, Merit, Picard
from tomoskin.model.skin import Skin
from tomoskin.sensing.fit import ResolutionBounds

if TYPE_CHECKING:
    from matplotlib.axes import Axes


_ACROSS = 3
_LINE, _MARK = "tab:blue", "tab:red"
_MOST = 30.0
"""A panel ends at so many times the chosen value: what lies far above is of no interest."""


def write_choices(
    path: StrPath,
    title: str,
    choices: Sequence[AlphaChoice],
    picard: Picard | None = None,
    *,
    overwrite: bool = False,
) -> None:
    """Draw one panel for each choice that has a curve, and one for the Picard plot.

    Raises
    ------
    DataError
        When matplotlib is not installed, and as :func:`written` does.
    """
    drawn = [(choice, choice.curve) for choice in choices if choice.curve is not None]
    count = len(drawn) + (picard is not None)
    columns = max(min(count, _ACROSS), 1)
    rows = max(-(-count // columns), 1)
    figure = new_figure(path, 4.4 * columns, 3.4 * rows + 0.4)
    figure.suptitle(title, fontsize=11)
    axes = panel_axes(figure, count, columns)
    for ax, (choice, curve) in zip(axes, drawn, strict=False):
        _draw(ax, choice, curve)
    if picard is not None:
        _draw_picard(axes[len(drawn)], picard)
    save_figure(path, figure, overwrite=overwrite)


def _draw(ax: Axes, choice: AlphaChoice, curve: Curve) -> None:
    ax.plot(curve.x, curve.y, color=_LINE, linewidth=1.4)
    x, y = curve.x[curve.chosen], curve.y[curve.chosen]
    ax.plot(x, y, "o", color=_MARK, markersize=6)
    ax.set_xscale("log")
    if curve.y.min() > 0:
        ax.set_yscale("log")
        ax.set_ylim(top=min(1.2 * curve.y.max(), _MOST * y))
    title = f"{choice.rule}: alpha = {choice.alpha:.3g}"
    dress(ax, title, "alpha", curve.label)


def _draw_picard(ax: Axes, picard: Picard) -> None:
    index = np.arange(1, len(picard.singular_values) + 1)
    ax.semilogy(index, picard.singular_values, color="0.2", label="σ")
    ax.semilogy(index, picard.coefficients, "x", color=_LINE, markersize=4, label="|uᴴW^½dv|")
    ax.semilogy(index, picard.solution, ".", color="tab:orange", markersize=4, label="|uᴴW^½dv|/σ")
    if np.isfinite(picard.noise).any():
        ax.semilogy(index, picard.noise, color=_MARK, linestyle=":", label="noise")
    condition = picard.singular_values[0] / picard.singular_values[-1]
    dress(ax, f"Picard plot: condition {condition:.2g}", "mode", "")
    ax.locator_params(axis="x", integer=True)
    ax.legend(fontsize=7)


_FIGURES = (
    ("amplitude", "", "amplitude response", 1.0),
    ("position_error", "_m", "position error (mm, inwards above 0)", 1e3),
    ("offset", "_m", "distance from the target (mm)", 1e3),
    ("resolution", "", "resolution (fraction of the extent)", 1.0),
    ("deformation", "", "shape deformation", 1.0),
    ("ringing", "", "ringing", 1.0),
)
"""Name in :class:`Merit`, ending in a table, label of a plot, and factor to the label's unit."""

COLUMNS = (
    *("operator", "noise_figure", "distance_m"),
    *(name + ending for name, ending, _, _ in _FIGURES),
)


def write_merit(path: StrPath, merits: Mapping[str, Merit], *, overwrite: bool = False) -> None:
    """Draw a panel per figure with a curve per operator, named by the keys of ``merits``.

    Raises
    ------
    DataError
        When matplotlib is not installed, and as :func:`written` does.
    """
    figure = new_figure(path, 10.5, 6.0)
    for ax, (name, _, label, factor) in zip(figure.subplots(2, 3).ravel(), _FIGURES, strict=True):
        for operator, merit in merits.items():
            shown = f"{operator} (noise figure {merit.noise_figure:.2g})"
            ax.plot(1e3 * merit.distance, factor * getattr(merit, name), ".-", label=shown)
        dress(ax, "", "distance from the centre (mm)", label)
        low = min(0.0, *(float(np.nanmin(getattr(m, name), initial=0.0)) for m in merits.values()))
        ax.set_ylim(bottom=1.1 * factor * low)
    ax.legend(fontsize=7)
    save_figure(path, figure, overwrite=overwrite)


def write_merit_table(
    path: StrPath, merits: Mapping[str, Merit], *, overwrite: bool = False
) -> None:
    """Write a CSV file of :data:`COLUMNS`, a row for each operator and target.

    Raises as :func:`written` does.
    """
    rows: list[Sequence[object]] = [COLUMNS]
    for operator, merit in merits.items():
        table = (merit.distance, *(getattr(merit, name) for name, *_ in _FIGURES))
        for row in zip(*table, strict=True):
            rows.append([operator, *(f"{number:.6g}" for number in (merit.noise_figure, *row))])
    write_rows(path, rows, overwrite=overwrite)


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
    left, right = figure.subplots(1, 2)
    maps = (
        (left, _MM * bounds.rms, "least RMS error of the position (mm)"),
        (right, 100 * bounds.faintest, "faintest press that is detected (% of the conductivity)"),
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
