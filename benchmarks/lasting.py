"""A press held for an hour on a drifting twin: is it reported all the time, and then gone?"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

import force as weighing
from bench_rig import Rig, gap
from report import Report, percent, progress, table
from tomoskin.core import Touch
from tomoskin.learning import FORCE
from tomoskin.model.skin import Skin
from tomoskin.pipeline import Pipeline, prepare
from tomoskin.twin import Press

SEED = 11
"""Nothing here was chosen on it."""

CASES = (("textile-disc-8", "image"), ("textile-disc-8", "fit"), ("textile-disc-16", "fit"))
FORCES, RADIUS, SPREAD = (3.0, 8.0), 0.012, 0.05
HOUR, LEAD, AFTER = 3600.0, 30.0, 60.0
"""Seconds held, before and after."""

SETTLING = "40 ms"
"""For some frames a second: an hour holds enough of them."""

WARMING = 5.0
"""K by which the sheet warms up in the hour, beside its own wandering: 0.38 % of all a kelvin."""


def run() -> Iterator[Report]:
    yield table(
        f"a press held for {HOUR / 60:.0f} minutes while the sheet warms up by {WARMING:g} K",
        (held(*case, force) for case in CASES for force in FORCES),
        f"preset textile (creep, a wandering temperature, wear), time of the twin, seed {SEED}; "
        "frames are counted from the onset",
        "forces: medians of the first and of the last minute; calibrated by presses of 2 s",
    )


def held(name: str, method: str, force: float) -> dict[str, Any]:
    """What is reported of one press, from the frame on in which it is first."""
    progress(f"{name}, {method}, {force:g} N")
    changes = {"touch": {"method": method}, "readout": {"settling": SETTLING}}
    prepared = prepare(Skin.load(name).altered(changes))
    if method == "fit":  # presses of the same tip teach forces
        model = weighing.calibrated(weighing.Scale(SEED, (RADIUS,), skin=name))
        prepared = prepared.calibrated(FORCE.of(model, prepared.pattern, prepared.skin))
    x, y = np.random.default_rng(SEED).uniform(-SPREAD, SPREAD, 2).tolist()
    rig, pipeline = Rig(prepared.skin, "textile", SEED), Pipeline(prepared)
    frames, gone = list[tuple[Touch, ...]](), np.inf
    while (time := rig.number * rig.interval - LEAD) < HOUR + AFTER:
        pressed = 0 <= time < HOUR
        result = pipeline.push(rig.frame([Press(x, y, force, RADIUS)] if pressed else ()))
        if pressed:
            rig.board.sheet.warm(WARMING * rig.interval / HOUR)
            if result and (frames or result.touches):
                frames.append(result.touches)
        elif result and time >= HOUR and not result.touches:
            gone = min(gone, time - HOUR)
    alone = [touches[0] for touches in frames if len(touches) == 1]
    ends = alone[: len(alone) // 60], alone[-len(alone) // 60 :]
    error, strength = (
        [np.median([value(touch) for touch in end]) for end in ends]
        for value in (lambda t: 1e3 * gap(t, (x, y)), lambda t: abs(t.detection.peak))
    )
    newtons = [
        np.median([t.detection.force.value for t in end if t.detection.force] or [np.nan])
        for end in ends
    ]
    return {
        "skin": name,
        "method": method,
        "N": force,
        "frames": len(frames),
        "with this touch alone": percent(len(alone) / len(frames)),
        "identities": len({touch.id for touch in alone}),
        "error at first, at the end, mm": f"{error[0]:.1f}, {error[1]:.1f}",
        "strength at the end": percent(strength[1] / strength[0]),
        "gone after, s": f"{gone:.1f}",
        "N at first, at the end": f"{newtons[0]:.2f}, {newtons[1]:.2f}",
    }
