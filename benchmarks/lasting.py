"""A press held for an hour on a drifting twin: is it reported all the time, and then gone?"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

import force as weighing
from bench_rig import Rig, gap, nearest
from report import Floats, Report, progress, table
from tomoskin.core import Touch
from tomoskin.learning import FORCE
from tomoskin.model.skin import Skin
from tomoskin.pipeline import Pipeline, Prepared, prepare
from tomoskin.twin import Press

SEEDS = (11,)
"""Nothing here was chosen on them."""

CASES = (("textile-disc-8", "image"), ("textile-disc-8", "fit"), ("textile-disc-16", "fit"))
FORCES = (3.0, 8.0)
HOUR, LEAD, AFTER = 3600.0, 30.0, 60.0
"""Seconds held, before and after."""

SETTLING = "40 ms"
"""For some frames a second: an hour holds enough of them."""

WARMING = 5.0
"""K by which the sheet warms up in the hour, beside its own wandering: 0.38 % of all a kelvin."""

RADIUS, SPREAD = 0.012, 0.05

Seen = tuple[float, tuple[Touch, ...]]
"""A frame: seconds since the press, or since it was lifted, and the touches in it."""


def run() -> Iterator[Report]:
    rows = []
    for name, method in CASES:
        changes = {"touch": {"method": method}, "readout": {"settling": SETTLING}}
        prepared = prepare(Skin.load(name).altered(changes))
        for seed in SEEDS:
            weighed = _weighing(prepared, seed) if method == "fit" else prepared
            for force in FORCES:
                progress(f"{name}, {method}, {force:g} N, seed {seed}")
                place = np.random.default_rng(seed).uniform(-SPREAD, SPREAD, 2)
                case = {"skin": name, "method": method, "N": force, "seed": seed}
                rows.append(case | judged(*seen(weighed, place, force, seed), place))
    yield table(
        f"a press held for {HOUR / 60:.0f} minutes while the sheet warms up by {WARMING:g} K",
        rows,
        "preset textile (creep, a wandering temperature, wear), time of the twin; "
        "frames are counted from the onset",
        "forces: medians of the first and of the last minute; calibrated by presses of 2 s",
    )


def _weighing(prepared: Prepared, seed: int) -> Prepared:
    """With a calibration of forces, by short presses of the same tip."""
    scale = weighing.Scale(seed, (RADIUS,), prepared.skin.name)
    model = weighing.calibrated(scale)
    return prepared.calibrated(FORCE.of(model, prepared.pattern, prepared.skin))


def seen(
    prepared: Prepared, place: Floats, force: float, seed: int, hold: float = HOUR
) -> tuple[list[Seen], list[Seen]]:
    """Frames while a press is held, and after it is lifted."""
    rig, pipeline = Rig(prepared.skin, "textile", seed), Pipeline(prepared)
    press = (Press(float(place[0]), float(place[1]), force=force, radius=RADIUS),)
    held, after, warmed = [], [], 0.0
    while (time := rig.number * rig.interval - LEAD) < hold + AFTER:
        result = pipeline.push(rig.frame(press if 0 <= time < hold else ()))
        if result is None or time < 0:
            continue
        if time >= hold:
            after.append((time - hold, result.touches))
            continue
        held.append((time, result.touches))
        due = WARMING * time / hold
        rig.board.sheet.warm(due - warmed)
        warmed = due
    return held, after


def judged(held: Sequence[Seen], after: Sequence[Seen], place: Floats) -> dict[str, Any]:
    """What stands in a row, from the frames on in which it was first reported."""
    begun = next((n for n, (_, touches) in enumerate(held) if touches), len(held))
    frames = held[begun:]
    if not frames:
        return {"frames": 0}
    near = [(time, nearest(touches, place)) for time, touches in frames]
    found = [touch for _, touch in near if touch is not None]
    gaps = np.diff([*(time for time, touch in near if touch is not None), held[-1][0]])
    errors = [np.nan if t is None else 1e3 * gap(t, place) for _, t in near]
    strength = [np.nan if t is None else abs(t.detection.peak) for _, t in near]
    forces = [t.detection.force.newtons for t in found if t.detection.force]
    few = max(1, len(frames) // 60)
    gone = next((time for time, touches in after if not touches), None)
    first, last = (slice(few), slice(-few, None))
    grown = np.nanmedian(strength[last]) / np.nanmedian(strength[first])
    return {
        "frames": len(frames),
        "frames reported, %": f"{100 * len(found) / len(frames):.2f}",
        "longest gap, s": f"{gaps.max():.1f}",
        "identities": len({t.id for t in found}),
        "frames with another touch, %": f"{100 * np.mean([len(t) > 1 for _, t in frames]):.2f}",
        "error at first, mm": f"{np.nanmedian(errors[first]):.1f}",
        "at the end, mm": f"{np.nanmedian(errors[last]):.1f}",
        "strength at the end, %": f"{100 * grown:.0f}",
        "gone after, s": "never" if gone is None else f"{gone:.1f}",
        "N at first": f"{np.median(forces[first]):.2f}" if forces else None,
        "N at the end": f"{np.median(forces[last]):.2f}" if forces else None,
    }
