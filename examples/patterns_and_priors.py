"""The thesis's four metrics over drive patterns and priors (its section 4.4.1).

An 18 mm probe at 5 N at the centre, half-way out and near the rim. One scan reads the rows of all
patterns; each pattern then takes its own, so that all see the same presses. One step on normalised
differences; alpha is chosen for each by the same rule from the noise.

Shown: mean of each metric over the three places; patterns across, priors down.
Thesis saw: adjacent driving with a NOSER or Gaussian prior places a press to within centimetres
(chapter 8); no table.
Checked: for every pattern and prior the mean ERR75 is below 20 mm, and for adjacent driving with
NOSER below 10 mm; RES75 ≥ RES50 and 0 < shape angle ≤ 90° everywhere.
Assumed: the same number of readings of each row. A pattern with fewer rows is then as quick as one
with more, which a board is not: at equal time for a frame it would average more readings of each.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

import figures
from imaging import Imager
from lab import Lab, in_front_of, open_lab, report
from tomoskin.core import FloatArray
from tomoskin.imaging import ThesisMetrics
from tomoskin.model.pattern import match_rows
from tomoskin.twin import Circle, Probe

PATTERNS = ("adjacent", "opposite", "skip:2")
PRIORS = ("identity", "laplace", "gaussian", "noser")
RADIUS, FORCE = 18e-3, 5.0
ALL_ROWS = {"drive": {"pattern": "+".join(PATTERNS)}, "readout": {"gain": 30}}
"""At the skin's own gain of 35 a press near the rim brings a driven channel to the rail."""

COLUMNS = {
    "maximum / mS": lambda m: 1e3 * m.maximum,
    "RES50": lambda m: m.res50,
    "RES75": lambda m: m.res75,
    "shape angle / °": lambda m: np.degrees(m.shape_angle),
    "ERR75 / mm": lambda m: 1e3 * m.error75,
}

Table = dict[tuple[str, str], list[ThesisMetrics]]


def main(arguments: Sequence[str] | None = None) -> dict[str, float]:
    """Measure, check, draw; the numbers that were checked."""
    with open_lab("patterns_and_priors", arguments, __doc__, ALL_ROWS) as lab:
        centre = tuple(lab.skin.outline.centre.tolist())
        places = {
            "at the centre": centre,
            "half-way to E2": in_front_of(lab.skin, 1, 50e-3),
            "30 mm from E5": in_front_of(lab.skin, 4, 30e-3),
        }
        idle = lab.measure("nothing touches the skin")
        loaded = {
            place: lab.measure(f"18 mm probe, 5 N, {name}", Probe(Circle(RADIUS), *place, FORCE))
            for name, place in places.items()
        }
        table = {
            (pattern, prior): metrics_of(lab, pattern, prior, idle, loaded)
            for pattern in PATTERNS
            for prior in PRIORS
        }
        found = check(table)
        draw(lab, table)
    return found


def metrics_of(
    lab: Lab,
    pattern: str,
    prior: str,
    idle: FloatArray,
    loaded: Mapping[tuple[float, float], FloatArray],
) -> list[ThesisMetrics]:
    """One for each place."""
    inverse = {"prior": prior, "difference": "normalised", "alpha": "auto"}
    skin = lab.skin.altered({"drive": {"pattern": pattern}, "inverse": inverse})
    rows = match_rows(skin.pattern(), lab.skin.pattern().drive, lab.skin.pattern().measure)
    imager = Imager(skin)
    pictures = {
        place: imager.picture(rows.apply(idle), rows.apply(frames))
        for place, frames in loaded.items()
    }
    return [imager.metrics(picture, place) for place, picture in pictures.items()]


def check(table: Table) -> dict[str, float]:
    """Mean ERR75 of each pattern and prior."""
    found = {}
    for (pattern, prior), metrics in table.items():
        error = 1e3 * float(np.mean([m.error75 for m in metrics]))
        assert error < 20, f"{pattern}, {prior}: ERR75 of {error:.0f} mm"
        assert all(m.res75 >= m.res50 for m in metrics)
        assert all(0 < m.shape_angle <= np.pi / 2 for m in metrics)
        found[f"{pattern}, {prior}: ERR75, mm"] = error
    assert found["adjacent, noser: ERR75, mm"] < 10
    return found


def draw(lab: Lab, table: Table) -> None:
    """Mean of each metric over the places: patterns across, priors down."""
    made, axes = figures.figure(1, len(COLUMNS), (9.6, 2.2), sharey=True)
    for ax, (name, value) in zip(axes[0], COLUMNS.items(), strict=True):
        means = np.array([
            [np.mean([value(m) for m in table[pattern, prior]]) for pattern in PATTERNS]
            for prior in PRIORS
        ])  # fmt: skip
        _cells(ax, means)
        ax.set_title(name)
    axes[0, 0].set_yticks(range(len(PRIORS)), PRIORS)
    lab.figure.save(made)


def _cells(ax: Any, means: FloatArray) -> None:
    amounts = np.abs(means)  # a fall is shown by its size
    ax.imshow(amounts, cmap=figures.AMOUNTS, aspect="auto")
    middle = (amounts.min() + amounts.max()) / 2
    for (row, column), mean in np.ndenumerate(means):
        colour = "white" if abs(mean) > middle else "black"
        ax.text(column, row, f"{mean:.3g}", ha="center", va="center", color=colour)
    ax.set_xticks(range(len(PATTERNS)), PATTERNS)
    ax.tick_params(length=0)


if __name__ == "__main__":
    report(main())
