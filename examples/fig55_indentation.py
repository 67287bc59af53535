"""Figures 5.5 and 5.6: a 15 mm probe at 3 N in front of E2, then of E7; change by ground electrode.

The probe's edge is 7.5 mm from the electrode (source: 5 to 10 mm); mean of 10 frames.

Shown: the change of each row; orange are pairs that contain the electrode behind the probe, grey
groups are drives through it.
Thesis saw: the largest negative changes in the pairs that contain that electrode (where it does not
drive itself).
Checked: of the rows that the electrode does not drive, the 6 most negative all contain it; every
pair that contains it falls, and on average the others do not.
Assumed: a gauge factor of 10; 1.2 to 2.4 are published for knits. Figure 5.7 has what 2.4 changes.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

import figures
from lab import Lab, in_front_of, open_lab, report, source_drive
from tomoskin.core import FloatArray
from tomoskin.twin import Circle, Probe

N = 8
TESTED = (1, 6)
RADIUS, FORCE, GAP = 15e-3, 3.0, 7.5e-3


def main(arguments: Sequence[str] | None = None) -> dict[str, float]:
    """Measure, check, draw; the numbers that were checked."""
    found: dict[str, float] = {}
    with open_lab("fig55_indentation", arguments, __doc__, source_drive(N)) as lab:
        changes = []
        for electrode in TESTED:
            name = f"E{electrode + 1}"
            idle = lab.measure(f"nothing touches the skin (before {name})")
            x, y = in_front_of(lab.skin, electrode, GAP + RADIUS)
            probe = Probe(Circle(RADIUS), x, y, FORCE)
            loaded = lab.measure(f"15 mm probe, 3 N, 7.5 mm in front of {name}", probe)
            change = lab.by_ground(loaded.mean(axis=0) - idle.mean(axis=0))
            found |= check(name, electrode, change)
            changes.append(change)
        draw(lab, changes)
    return found


def check(name: str, electrode: int, change: FloatArray) -> dict[str, float]:
    """``change`` (ground, pair) V, NaN where a pair is driven."""
    drives, holds = driven_by(electrode), containing(electrode)
    counted = ~np.isnan(change) & ~drives[:, None]
    with_it, others = change[counted & holds], change[counted & ~holds]
    lowest = np.argsort(np.where(counted, change, np.inf).ravel())[:6]
    assert np.broadcast_to(holds, change.shape).ravel()[lowest].all(), f"{name}: others fall more"
    assert (with_it < 0).all(), f"{name}: a pair that contains it rises by {with_it.max():.2g} V"
    assert others.mean() > with_it.mean() / 4, f"{name}: the others fall as well"
    return {
        f"{name} least of its pairs, V": float(with_it.min()),
        f"{name} mean of its pairs, V": float(with_it.mean()),
        f"{name} mean of the others, V": float(others.mean()),
    }


def driven_by(electrode: int) -> np.ndarray:
    """(N,) grounds under which the electrode is ground itself, or source."""
    return np.isin(np.arange(N), [electrode, (electrode + 1) % N])


def containing(electrode: int) -> np.ndarray:
    """(1, N) pairs that the electrode is part of."""
    return np.isin(np.arange(N), [electrode, (electrode - 1) % N])[None, :]


def draw(lab: Lab, changes: Sequence[FloatArray]) -> None:
    """One panel per electrode: its pairs coloured, its own drives shaded."""
    made, axes = figures.figure(len(TESTED), 1, (7.2, 4.6), sharex=True)
    for ax, electrode, change in zip(axes[:, 0], TESTED, changes, strict=True):
        name = f"E{electrode + 1}"
        figures.shade(ax, N, np.flatnonzero(driven_by(electrode)))
        own = np.broadcast_to(containing(electrode), change.shape).ravel()
        bars = figures.UV * np.nan_to_num(change).ravel()
        place = figures.places(N)
        ax.bar(place[own], bars[own], width=0.8, color=figures.ORANGE, label=f"pairs with {name}")
        ax.bar(place[~own], bars[~own], width=0.8, color=figures.BLUE, label="other pairs")
        figures.groups(ax, N)
        ax.set_ylabel("V − V₀ / µV")
        ax.set_title(f"15 mm, 3 N, in front of {name} (shaded: {name} drives)", loc="left")
        ax.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=2)
    axes[0, 0].set_xlabel("")
    lab.figure.save(made)


if __name__ == "__main__":
    report(main())
