"""Figure 6.4 again: what polarised electrodes hide, and an alternating drive shows.

The face, its sessions and its expressions are those of figure 6.4 (fig64_face.py), with the real
part of what tissue answers. Each electrode has a double layer of 100 µF that charges under 1 mA and
leaks in 10 s, as in the twin. It also has a voltage of its own, which is another one two seconds
later. Skin that is stretched changes its potential by some 5 mV (Webster 1984, Reducing motion
artifacts and interference in biopotential recording). From 2 to 50 mV are tried. Direct drive reads
both. An alternating drive of 1 kHz takes each pair both ways, and reads half the difference. Within
a scan that voltage stands still here, so that only what the double layer does is left.

Shown: what the rows read of the electrodes alone, root mean square, from the start of the scan on,
with 5 mV; and how many expressions are recognised, by the electrodes' own voltage.
Thesis saw: with direct current, only "A" and the smile are recognised.
Checked: with the alternating drive the electrodes are seen a hundred times less, and at least 5 of
6 expressions are right in 90 % of the runs at any voltage; with 50 mV in more than with direct
drive.
Assumed: the double layer (10 to 40 µF/cm² are published for smooth metal; a rough 0.5 cm² has some
ten times as much), its leak, and that the electrode's own voltage stands still within a scan. Where
it does not, the alternating drive reads its change too.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

import figures
from bodies import options_of
from fig64_face import (
    ASTRAY,
    CURRENT,
    LEARNT,
    NAMES,
    PATTERN,
    READ,
    RUNS,
    STRENGTH,
    WAVER,
    Frames,
    Session,
    sessions_of,
    whole_runs,
)  # fmt: skip
from lab import report
from tomoskin.board.wire import Drive
from tomoskin.core import FloatArray
from tomoskin.extras.classes import Classifier
from tomoskin.model.pattern import Scan
from tomoskin.twin import ElectronicsSettings, SampleTable, ScanClock, chopped_table, sample_table
from tomoskin.twin.circuit import Electrodes
from tomoskin.twin.presets import POLARISING

SCAN = Scan.of(PATTERN)
FREQUENCY, READINGS = 1000.0, 4
CLOCK = ScanClock(dead_time=5e-6, settling=84e-6, conversion=2e-6)
APART = 2.0
"""s from a relaxed frame to the one with the expression."""

OWN = (2e-3, 5e-3, 10e-3, 20e-3, 50e-3)
"""V that an electrode has by itself, standard deviation."""
USUAL = 5e-3

_DRIVES = [
    Drive(source, sink, mask)
    for (source, sink), mask in zip(SCAN.drives.tolist(), SCAN.masks.tolist(), strict=True)
]
TABLES = {
    "direct": sample_table(_DRIVES, READINGS, CLOCK),
    "alternating": chopped_table(_DRIVES, READINGS, CLOCK, FREQUENCY, 1),
}


def reader(
    table: SampleTable, volts: float, chance: np.random.SeedSequence
) -> Callable[[float], FloatArray]:
    """Gives (n_meas,) V that a scan begun then reads of electrodes that have ``volts`` V."""
    wandering = POLARISING | {"thermal_sd": volts, "thermal_time": APART}
    electrodes = Electrodes(8, CURRENT, replace(ElectronicsSettings(), **wandering), chance)

    def rows(time: float) -> FloatArray:
        values = electrodes.read(table, time)
        if table.directions > 1:
            values = table.demodulated(values)[0] / table.directions
        return np.asarray(values[SCAN.plus] - values[SCAN.minus])

    return rows


def frames_of(
    one: Session, random: np.random.Generator, table: SampleTable, volts: float
) -> Frames:
    """``RUNS`` runs through all expressions, each frame against a relaxed one just before it."""
    own = reader(table, volts, random.bit_generator.seed_seq.spawn(1)[0])  # type: ignore[attr-defined]
    rows, label, time = [], [], 0.0
    size = np.abs(one.relaxed)
    for _ in range(RUNS):
        for number, name in enumerate(NAMES):
            strength = np.exp(random.normal(0.0, STRENGTH))
            noise = READ * np.sqrt(2) * random.standard_normal(len(size))
            astray = (WAVER * one.moved[number] + ASTRAY) * random.standard_normal((3, 8))
            change = strength * one.changes[number] + np.einsum("med,de->m", one.slope, astray)
            before, after = own(time), own(time + APART)
            rows.append((change.real + noise + after - before) / size)
            label.append(name)
            time += 2 * APART
    return Frames(np.array(rows), np.array(label))


def recognised(
    sessions: Sequence[Session], seed: int, drive: str, volts: float
) -> NDArray[np.bool_]:
    """(runs, 6) whether each expression of each asked run was recognised."""
    random = np.random.default_rng([seed, list(TABLES).index(drive)])
    first, *more = [frames_of(one, random, TABLES[drive], volts) for one in sessions]
    known = Classifier.fit(first.dv.real, first.label)
    for one in more[: LEARNT - 1]:
        codes = known.examples.codes.flags_of(one.label.tolist())
        known = known.in_session(one.dv.real, codes)
    right = []
    for one in more[LEARNT - 1 :]:
        x = one.dv.real
        right.append(np.array(known.in_session(x).predict(x).label) == one.label)
    return np.concatenate(right).reshape(-1, len(NAMES))


def seen(drive: str, seed: int, seconds: float = 20.0) -> tuple[FloatArray, FloatArray]:
    """Times, s, and root mean square over the rows, V, that is read of the electrodes."""
    rows = reader(TABLES[drive], USUAL, np.random.SeedSequence(seed))
    times = np.arange(0.0, seconds, TABLES[drive].seconds)
    return times, np.array([np.sqrt(np.mean(rows(float(time)) ** 2)) for time in times])


def main(arguments: Sequence[str] | None = None) -> dict[str, float]:
    """Move, measure, recognise, draw; the numbers that were checked."""
    options = options_of("fig64_chopped", arguments, __doc__)
    sessions = sessions_of(options.seed)
    right = {
        drive: [recognised(sessions, options.seed, drive, volts) for volts in OWN]
        for drive in TABLES
    }
    courses = {drive: seen(drive, options.seed) for drive in TABLES}
    mean = {drive: 1e6 * float(volts.mean()) for drive, (_, volts) in courses.items()}
    found = {f"{drive}: of electrodes, µV": volts for drive, volts in mean.items()}
    for drive, parts in right.items():
        for volts in (USUAL, OWN[-1]):
            part = float(parts[OWN.index(volts)].mean())
            found[f"{drive}: right with {1e3 * volts:g} mV"] = part
    ratio = mean["direct"] / mean["alternating"]
    assert ratio > 100, f"the electrodes are seen only {ratio:.0f} times less"
    runs = [whole_runs(part) for part in right["alternating"]]
    assert min(runs) >= 0.9, f"runs with 5 of 6 by the alternating drive: {runs}"
    assert runs[-1] > whole_runs(right["direct"][-1]), f"no better than direct: {found}"
    options.figure.save(draw(courses, right))
    return found


def draw(
    courses: dict[str, tuple[FloatArray, FloatArray]], right: dict[str, list[NDArray[np.bool_]]]
) -> Figure:
    """What is read of the electrodes, and what is recognised."""
    made, axes = figures.figure(1, 2, (8.2, 3.4))
    course, share = axes[0]
    for number, (drive, (times, volts)) in enumerate(courses.items()):
        course.semilogy(times, 1e6 * volts, color=f"C{number}", label=drive)
        parts = [100 * float(part.mean()) for part in right[drive]]
        share.semilogx(1e3 * np.array(OWN), parts, "o-", color=f"C{number}", label=drive)
    course.set_xlabel("time / s")
    course.set_ylabel("read of the electrodes / µV")
    course.set_title("electrodes alone")
    share.set_xticks(1e3 * np.array(OWN), [f"{1e3 * volts:g}" for volts in OWN], minor=False)
    share.set_xticks([], minor=True)
    share.set_xlabel("electrodes' own voltage / mV")
    share.set_ylabel("expressions recognised / %")
    share.set_ylim(0, 103)
    share.set_title("expressions")
    share.legend(fontsize=7)
    figures.letters([course, share])
    return made


if __name__ == "__main__":
    report(main())
