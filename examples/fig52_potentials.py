"""Figures 5.2 and 5.3: potentials at E3 and E6 over a full cycle of the adjacent drive.

Nothing touches the skin; each value is the potential between an electrode and the next one, the
mean of 10 frames with their standard deviation.

Shown: one value for each of the eight drives, in their order; the bars are fifty deviations, since
one cannot be seen.
Thesis saw: the extremes where the driving pair is near; a positive peak beside the ground, the
negative one where the electrode itself is the ground (sink).
Checked: the greatest value stands where the next electrode is the ground. Where the electrode
itself is the ground, the value is negative and one of the two least: on an even sheet, the mirror
image (the next electrode as source) reads the same. Without the three drives that touch the pair,
no value is over 10 % of the peak. The standard deviation is below 1 % of the peak, and above 0.
Assumed: a gain of 15, since driven electrodes rail at 35. The thesis says that driven electrodes
are not read (4.2.2), and shows E3 while it is the sink: so they are read here. Its picture may mix
potential and difference; here each value is a difference.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

import figures
from lab import Lab, open_lab, report, source_drive
from tomoskin.core import FloatArray

N = 8
SHOWN = (2, 5)
MAGNIFIED = 50
"""Error bars show so many standard deviations: one could not be seen."""

CHANGES = source_drive(N, driven=True) | {"readout": {"gain": 15}}
"""Driven electrodes stand at up to 0.25 V: the usual gain of 35 would rail."""


def main(arguments: Sequence[str] | None = None) -> dict[str, float]:
    """Measure, check, draw; the numbers that were checked."""
    with open_lab("fig52_potentials", arguments, __doc__, CHANGES) as lab:
        volts = lab.measure("nothing touches the skin")
        found: dict[str, float] = {}
        for electrode in SHOWN:
            cycle = volts[:, lab.skin.pattern().measure[:, 0] == electrode]
            found |= check(f"E{electrode + 1}", electrode, cycle)
        draw(lab, volts)
    return found


def check(name: str, electrode: int, cycle: FloatArray) -> dict[str, float]:
    """``cycle`` (n_frames, n_drives) V, by the electrode that enters the current."""
    mean, sd = cycle.mean(axis=0), cycle.std(axis=0, ddof=1)
    ground = (np.arange(N) + 1) % N
    beside = (electrode + 1) % N
    assert mean[ground == electrode] < 0, "the value where it is ground is not negative"
    assert electrode in ground[np.argsort(mean)[:2]], "the least values are elsewhere"
    assert ground[mean.argmax()] == beside, "the greatest value is not beside the ground"
    peak = float(mean.max())
    near = np.isin(ground, [electrode, beside, (electrode + 2) % N])
    far = float(np.abs(mean[~near]).max() / peak)
    assert far < 0.10, f"{name}: {far:.2f} of the peak far from the drive"
    assert 0 < sd.max() < 0.01 * peak, f"{name}: a deviation of {sd.max():.2g} V"
    return {f"{name} peak, V": peak, f"{name} far/peak": far, f"{name} sd, V": float(sd.max())}


def draw(lab: Lab, volts: FloatArray) -> None:
    """One panel per electrode."""
    made, axes = figures.figure(1, len(SHOWN), (7.2, 2.9), sharey=True)
    for ax, electrode in zip(axes[0], SHOWN, strict=True):
        cycle = figures.MV * volts[:, lab.skin.pattern().measure[:, 0] == electrode]
        ax.axhline(0.0, color="0.4", linewidth=0.6)
        ax.errorbar(
            np.arange(N), cycle.mean(axis=0), MAGNIFIED * cycle.std(axis=0, ddof=1),
            marker="o", markersize=4, linewidth=1.2, capsize=3, color=figures.BLUE,
        )  # fmt: skip
        ax.set_title(
            f"between E{electrode + 1} and E{electrode + 2}; bars: {MAGNIFIED} standard deviations"
        )
        ax.set_xticks(np.arange(N), [f"E{(k + 1) % N + 1}" for k in range(N)])
        ax.set_xlabel("grounded electrode (current enters at the one before)")
    axes[0, 0].set_ylabel("potential difference / mV")
    lab.figure.save(made)


if __name__ == "__main__":
    report(main())
