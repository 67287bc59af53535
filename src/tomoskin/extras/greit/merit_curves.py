"""Figures of merit over distance: curves and a table."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from tomoskin.core import StrPath, write_rows
from tomoskin.extras.greit.merit import Merit
from tomoskin.files.exports import dress, new_figure, save_figure

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
