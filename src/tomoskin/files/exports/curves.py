"""Curves that alpha was read from, and the Picard plot."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from tomoskin.core import StrPath
from tomoskin.files.exports.picture import dress, panel_figure, save_figure
from tomoskin.imaging import AlphaChoice, Curve, Picard

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
    figure, axes = panel_figure(path, count, _ACROSS, (4.4, 3.4), (0.0, 0.4))
    figure.suptitle(title, fontsize=11)
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
