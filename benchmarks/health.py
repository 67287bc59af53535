"""Health: sick electrodes, a ten-minute press under drift, false alarms, and what they cost."""

from __future__ import annotations

import time
from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path

import numpy as np

from health_real import real_reports
from health_rig import PROBE, Rig, missed_by, places
from report import Report
from tomoskin.core import FloatArray
from tomoskin.model.skin import Skin
from tomoskin.pipeline import Pipeline, Prepared, prepare
from tomoskin.pipeline.conditioning import BaselineDifferences
from tomoskin.sensing.signal import Health, Reference
from tomoskin.twin import Faults, Press

SEEDS = (0, 1, 2, 3, 4, 5)
CUT_SKINS = (("textile-disc-16", "textile"), ("textile-disc-16", "ideal"))
PRESSES = 30
FORCE = 4.0
REACH = 0.085
LONG = 600.0
AS_TAKEN = {"baseline": "hold", "common_modes": "kept"}


def run(data: Path | None) -> tuple[Report, ...]:
    """Every part; ``data`` is the folder of public recordings, for the last."""
    return (cuts(), long_presses(), false_alarms(), cost(), *real_reports(data))


@dataclass
class _Cut:
    """What became of one stage: mm by which presses were missed, and what should not be."""

    missed: list[float] = field(default_factory=list)
    noticed: list[int] = field(default_factory=list)
    ghosts: int = 0
    extra: int = 0


def cuts() -> Report:
    """No electrode, one and then two cut off while running."""
    rows = []
    for name, preset in CUT_SKINS:
        prepared = prepare(Skin.load(name))
        stages = [_Cut(), _Cut(), _Cut()]
        for seed in SEEDS:
            _cut_run(prepared, preset, seed, stages)
        whole = float(np.nanmedian(stages[0].missed))
        for number, stage in enumerate(stages):
            median, p90 = np.nanmedian(stage.missed), np.nanpercentile(stage.missed, 90)
            rows.append(
                (
                    f"{name}, {preset}",
                    number,
                    max(stage.noticed, default="–"),
                    round(float(median), 2),
                    round(float(median) / whole, 2),
                    round(float(p90), 1),
                    int(np.isnan(stage.missed).sum()),
                    stage.ghosts,
                    stage.extra,
                )
            )
    return Report(
        "electrodes cut off while running",
        (
            "skin",
            "cut",
            "noticed after frames",
            "median error mm",
            "of the whole skin's",
            "p90 mm",
            "not found",
            "ghosts at the cut",
            "ghosts beside presses",
        ),
        tuple(rows),
        (
            f"seeds {SEEDS}: each cuts two electrodes of its own, one after the other, 6 idle "
            "frames at each cut, then presses",
            f"{PRESSES} presses a seed of {FORCE:g} N and {1e3 * PROBE:g} mm within "
            f"{1e3 * REACH:g} mm, 5 frames each, the last is counted",
            "promised: noticed within 3 frames, 1.5 times the error",
        ),
    )


def _cut_run(prepared: Prepared, preset: str, seed: int, stages: list[_Cut]) -> None:
    random = np.random.default_rng(seed)
    first, second = random.choice(prepared.skin.n_electrodes, 2, replace=False).tolist()
    spots = places(random, PRESSES, REACH)
    rig, pipeline = Rig(prepared.skin, preset, seed), Pipeline(prepared)
    rig.push(pipeline, 50)
    for stage, cut in zip(stages, ((), (first,), (first, second)), strict=True):
        faults = Faults(cut=frozenset(cut))
        idle = rig.push(pipeline, 6, (), faults)
        stage.ghosts += sum(len(result.touches) for result in idle)
        if cut:
            sick = [_named(result.health, cut[-1]) for result in idle]
            stage.noticed.append(sick.index(True) + 1 if True in sick else 99)
        for place in spots:
            press = Press(*place.tolist(), FORCE, PROBE)
            result = rig.push(pipeline, 5, [press], faults)[-1]
            stage.missed.append(missed_by(result.touches, place))
            stage.extra += max(0, len(result.touches) - 1)
            rig.push(pipeline, 6, (), faults)


def _named(health: Health | None, electrode: int) -> bool:
    return health is not None and any(e.electrode == electrode for e in health.sick)


def long_presses() -> Report:
    """A press of ten minutes while the sheet gets warmer."""
    rows = []
    for name, kelvin, setting in (
        ("textile-disc-8", 0.0, {}),
        ("textile-disc-8", 3.0, {}),
        ("textile-disc-8", 3.0, AS_TAKEN),
        ("textile-disc-16", 3.0, {}),
        ("textile-disc-16", 3.0, AS_TAKEN),
        ("textile-disc-8", 10.0, {}),
        ("textile-disc-8", 10.0, AS_TAKEN),
    ):
        skin = Skin.load(name).altered({"signal": setting})
        rows.append(_long(skin, kelvin, "held" if setting else "follows"))
    return Report(
        "a press of ten minutes, while the sheet gets warmer",
        (
            "skin",
            "K",
            "reference",
            "frames that see it %",
            "identities",
            "strength, last 200 frames by first",
            "error mm, first",
            "last",
            "ghosts meanwhile",
            "s until quiet after it",
            "frames with touches in the next minute",
        ),
        tuple(rows),
        (
            "preset textile, seed 1: creep of 1 and 30 s, hysteresis, 0.38 % per kelvin; the "
            "warming is even over the ten minutes",
            f"one press of {FORCE:g} N at (40, 20) mm; scripted time",
            "held: [signal] baseline hold, common_modes kept, as before",
        ),
    )


def _long(skin: Skin, kelvin: float, how: str) -> tuple[object, ...]:
    rig, pipeline = Rig(skin, "textile", 1), Pipeline(prepare(skin))
    rig.push(pipeline, round(60 / rig.interval))
    place, count = np.array([0.04, 0.02]), round(LONG / rig.interval)
    press = Press(*place.tolist(), FORCE, PROBE)
    peaks, missed, ids, ghosts = [], [], set(), 0
    for _ in range(count):
        rig.board.sheet.warm(kelvin / count)
        [result] = rig.push(pipeline, 1, [press])
        near = [t for t in result.touches if missed_by([t], place) < 30]
        ghosts += len(result.touches) - len(near)
        if near:
            peaks.append(near[0].detection.peak)
            missed.append(missed_by(near, place))
            ids.add(near[0].id)
    after = [bool(r.touches) for r in rig.push(pipeline, round(60 / rig.interval))]
    last = max(np.flatnonzero(after), default=-1) + 1
    return (
        skin.name,
        kelvin,
        how,
        round(100 * len(peaks) / count, 1),
        len(ids),
        round(float(np.median(peaks[-200:]) / np.median(peaks[5:205])), 2),
        round(float(np.median(missed[:200])), 1),
        round(float(np.median(missed[-200:])), 1),
        ghosts,
        round(last * rig.interval, 1),
        sum(after),
    )


def false_alarms() -> Report:
    """Electrodes called sick that are not, while nothing and while much touches."""
    rows = []
    for name, preset in (*CUT_SKINS, ("textile-disc-8", "textile"), ("tank-16", "tank")):
        prepared = prepare(Skin.load(name))
        for pressed in (False, True):
            rows.append((f"{name}, {preset}", *_alarms(prepared, preset, pressed=pressed)))
    return Report(
        "false alarms of electrode health",
        (
            "skin",
            "run",
            "frames",
            "frames with a sick electrode",
            "electrodes",
            "frames with touches",
        ),
        tuple(rows),
        (
            "seed 7; pressed: up to three presses at a time of 1 to 12 N anywhere within 95 % of "
            "the radius, begun and ended within a frame, 1 to 10 frames long, no two alike",
        ),
    )


def _alarms(prepared: Prepared, preset: str, *, pressed: bool) -> tuple[object, ...]:
    rig, pipeline = Rig(prepared.skin, preset, 7), Pipeline(prepared)
    random = np.random.default_rng(7)
    rig.push(pipeline, 40)
    reach = 0.95 * float(np.linalg.norm(prepared.skin.electrode_centres, axis=1).min())
    sick, named, touched, frames = 0, set(), 0, 0
    while frames < 6000:
        count = int(random.integers(1, 11))
        presses = _random_presses(random, reach) if pressed else ()
        for result in rig.push(pipeline, count, presses):
            found = result.health.sick if result.health else ()
            sick += bool(found)
            named |= {e.text for e in found}
            touched += bool(result.touches)
        frames += count
    return "pressed" if pressed else "idle", frames, sick, len(named), touched


def _random_presses(random: np.random.Generator, reach: float) -> tuple[Press, ...]:
    spots: list[FloatArray] = list(places(random, int(random.integers(0, 4)), reach))
    apart = all(np.linalg.norm(a - b) > 3 * PROBE for a, b in pairwise(spots))
    chosen = spots if apart else spots[:1]
    return tuple(Press(*p.tolist(), float(random.uniform(1, 12)), PROBE) for p in chosen)


def cost() -> Report:
    """Time of health, baseline and projection for one frame."""
    rows = []
    for name in ("textile-disc-8", "textile-disc-16"):
        skin = Skin.load(name)
        rig, prepared = Rig(skin, "textile", 1), prepare(skin)
        idle = np.array([prepared.readout(rig.frame()).values for _ in range(20)])
        none = np.zeros(idle.shape[1], bool)
        followed = BaselineDifferences.of(prepared, Reference.of(idle), none, prepared.scan)
        spent = []
        for _ in range(2000):
            frame = rig.frame()
            measured = prepared.readout(frame)
            start = time.process_time()
            followed.condition(measured)
            followed.learn(measured.time, 0.0, touched=False)
            spent.append(time.process_time() - start)
        rows.append((name, prepared.pattern.n_meas, *_microseconds(spent)))
    return Report(
        "health, baseline and projection: time of a frame",
        ("skin", "rows", "median µs", "mean µs", "p99 µs"),
        tuple(rows),
        ("2000 idle frames, processor time; every 256th looks for directions of drift",),
    )


def _microseconds(spent: list[float]) -> tuple[int, ...]:
    values = 1e6 * np.array(spent)
    return tuple(
        round(float(v)) for v in (np.median(values), values.mean(), np.percentile(values, 99))
    )
