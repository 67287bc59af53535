"""Figures of merit over the distance from the centre, as curves and as a table."""

from __future__ import annotations

import csv
from collections.abc import Mapping

import numpy as np

from tomoskin.core import StrPath, written
from tomoskin.files.exports.figure import dress, new_figure, save_figure
from tomoskin.imaging import Merit

_FIGURES = (
    ("amplitude", "amplitude response", 1.0),
    ("position_error", "position error (mm, inwards above 0)", 1e3),
    ("offset", "distance from the target (mm)", 1e3),
    ("resolution", "resolution (fraction of the extent)", 1.0),
    ("deformation", "shape deformation", 1.0),
    ("ringing", "ringing", 1.0),
)
"""Name in :class:`Merit`, label, and factor to the label's unit."""

COLUMNS = (
    "operator",
    "noise_figure",
    "distance_m",
    "amplitude",
    "position_error_m",
    "offset_m",
    "resolution",
    "deformation",
    "ringing",
)


def write_merit(path: StrPath, found: Mapping[str, Merit], *, overwrite: bool = False) -> None:
    """Draw a panel per figure with a curve per operator, named by the keys of ``found``.

    Raises
    ------
    DataError
        When matplotlib is not installed, and as :func:`written` does.
    """
    figure = new_figure(path, 10.5, 6.0)
    for ax, (name, label, factor) in zip(figure.subplots(2, 3).ravel(), _FIGURES, strict=True):
        for operator, merit in found.items():
            shown = f"{operator} (noise figure {merit.noise_figure:.2g})"
            ax.plot(1e3 * merit.distance, factor * getattr(merit, name), ".-", label=shown)
        dress(ax, "", "distance from the centre (mm)", label)
        low = min(0.0, *(float(np.nanmin(getattr(m, name), initial=0.0)) for m in found.values()))
        ax.set_ylim(bottom=1.1 * factor * low)
    ax.legend(fontsize=7)
    save_figure(path, figure, overwrite=overwrite)


def write_merit_table(
    path: StrPath, found: Mapping[str, Merit], *, overwrite: bool = False
) -> None:
    """Write a CSV file of :data:`COLUMNS`, a row for each operator and target.

    Raises as :func:`written` does.
    """
    with (
        written(path, overwrite=overwrite) as part,
        part.open("w", newline="", encoding="utf-8") as file,
    ):
        writer = csv.writer(file)
        writer.writerow(COLUMNS)
        for operator, merit in found.items():
            table = (merit.distance, *(getattr(merit, name) for name, _, _ in _FIGURES))
            for row in zip(*table, strict=True):
                numbers = (merit.noise_figure, *row)
                writer.writerow([operator, *(f"{number:.6g}" for number in numbers)])
