"""Figure 5.4: the full reference frame, all pairs under all adjacent drives, no load.

Every neighbouring pair is read under every adjacent drive, but pairs that touch a driven electrode:
forty rows, the mean of 10 frames.

Shown: forty rows in eight groups, one for each grounded electrode; gaps are pairs that are not
read.
Thesis saw: a frame whose extremes stand where the driving pair is near.
Checked: under each drive the two pairs beside the driving one read most, at least twice as much
as the pair opposite. Exchanging drive and measuring pair changes no value by more than 15 % of
the largest (reciprocity, Geselowitz 1971). Each channel has its own amplifier, and a gain that
differs by 0.2 % shows in the small difference of two potentials. The model of the skin expects
this frame (cosine over 0.98).
Assumed: contacts of 20 mΩ with 2 mΩ of scatter, gains that differ by 0.2 %. Both make the error of
reciprocity, and nothing else in the entry rests on them.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

import figures
from lab import Lab, open_lab, report, source_drive
from tomoskin.core import FloatArray
from tomoskin.model.forward import ForwardModel

N = 8


def main(arguments: Sequence[str] | None = None) -> dict[str, float]:
    """Measure, check, draw; the numbers that were checked."""
    with open_lab("fig54_reference", arguments, __doc__, source_drive(N)) as lab:
        mean = lab.measure("nothing touches the skin").mean(axis=0)
        found = check(lab, mean)
        draw(lab, mean)
    return found


def check(lab: Lab, mean: FloatArray) -> dict[str, float]:
    """``mean`` (n_meas,) V."""
    table = np.abs(lab.by_ground(mean))  # ground, pair
    steps = (np.arange(N)[None, :] - np.arange(N)[:, None]) % N  # from the ground to the pair
    beside, opposite = (steps == 1) | (steps == N - 3), steps == (N - 2) // 2
    near, far = table[beside], table[opposite]
    order = np.argsort(-np.nan_to_num(table), axis=1)[:, :2]
    assert np.take_along_axis(beside, order, axis=1).all(), "the extremes are not near the drive"
    ratio = float(near.mean() / far.mean())
    assert ratio > 2, f"near is only {ratio:.1f} times as much as opposite"
    drives = np.roll(table, -1, axis=0)  # by the electrode pair that is driven
    reciprocity = float(np.nanmax(np.abs(drives - drives.T)) / np.nanmax(table))
    assert reciprocity < 0.15, f"reciprocity misses by {reciprocity:.2f}"
    skin = lab.skin
    model = ForwardModel(skin.mesh(), skin.pattern(), skin.contact_impedance, skin.current)
    expected = model.solve(skin.conductivity).voltages
    cosine = float(mean @ expected / np.linalg.norm(mean) / np.linalg.norm(expected))
    assert cosine > 0.98, f"the model agrees by only {cosine:.3f}"
    return {"near/opposite": ratio, "reciprocity error": reciprocity, "cosine to model": cosine}


def draw(lab: Lab, mean: FloatArray) -> None:
    """Bars in groups by the grounded electrode."""
    made, axes = figures.figure(1, 1, (7.2, 2.6))
    table = figures.MV * lab.by_ground(mean)
    ax = axes[0, 0]
    ax.bar(figures.places(N), np.nan_to_num(table).ravel(), width=0.8, color=figures.BLUE)
    figures.groups(ax, N)
    ax.set_ylabel("potential difference / mV")
    lab.figure.save(made)


if __name__ == "__main__":
    report(main())
