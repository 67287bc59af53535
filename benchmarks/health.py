"""Health: electrodes cut off, false alarms, and drift and alarms on public recordings."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bench_rig import Rig, evenly, gap, nearest
from report import Floats, Report, available, mm, rms, table
from tomoskin.model.pattern import Pattern, undirected
from tomoskin.model.skin import Skin
from tomoskin.pipeline import Pipeline, Prepared, prepare
from tomoskin.sensing.signal import Baseline, Monitor, NuisanceSubspace, Reference
from tomoskin.twin import Faults, Press

SEEDS = (0, 1, 2, 3, 4, 5)
CUT_SKINS = (("textile-disc-16", "textile"), ("textile-disc-16", "ideal"))
WELL_SKINS = (*CUT_SKINS, ("textile-disc-8", "textile"), ("tank-16", "tank"))
PRESSES, FORCE, REACH, PROBE, WELL_FRAMES = 30, 4.0, 0.085, 0.012, 6000
IDLE = 20
"""First frames of a recording that make its reference."""

ROUND = "eskin_hydrogel_round"
SERIES = (
    ("eskin_membrane8_environment/env", "rms"),
    ("eskin_hydrogel_rect8/rect8_single10k", "v_up"),
    (f"{ROUND}/round16_single550", "v_up"),
    (f"{ROUND}/round16_single500_ohmc", "v_up"),
    (f"{ROUND}/round8_single500_ohmc", "v_up"),
    (f"{ROUND}/round16_damage_series", "v"),
    ("eskin_gelatin_rect32/baseline_SD", "v"),
    ("eskin_gelatin_rect32/baseline_ND", "v"),
    ("eskin_gelatin_rect32/baseline_SN", "v"),
)
PRESSED = (
    *((name, "v_down") for name, key in SERIES if key == "v_up"),
    ("eidors_tanks16/ottawa2005_moving_ball_series", "v"),
    ("eidors_tanks16/montreal1995_rod_circle", "v"),
)


def run(data: Path | None) -> Iterator[Report]:
    """The twin needs no recordings; the others are left out where there are none."""
    yield table(
        "electrodes cut off while running",
        _cuts(),
        f"seeds {SEEDS}: each cuts two electrodes of its own, one after the other, 6 idle "
        "frames at each cut, then presses",
        f"{PRESSES} presses a seed of {FORCE:g} N and {1e3 * PROBE:g} mm within "
        f"{1e3 * REACH:g} mm, 5 frames each, the last is counted",
        "promised: noticed within 3 frames, 1.5 times the error",
    )
    yield table(
        "false alarms of electrode health",
        (_alarms(*case, pressed=on) for case in WELL_SKINS for on in (False, True)),
        "seed 7; pressed: up to three presses at a time of 1 to 12 N anywhere within 95 % of "
        "the radius, begun and ended within a frame, 1 to 10 frames long, no two the same",
        across="run",
    )
    folder = available(data)
    if folder is None:
        return
    yield table(
        "drift of untouched skins",
        (_drifted(name, *_read(folder, name, key)) for name, key in SERIES),
        "rms over rows and frames of the difference from the reference, in deviations of one "
        "frame (from successive differences); median over frames; the first 20 make the "
        "reference, each later frame is predicted from those before it",
        "change: last twentieth against the first; modes: gain and directions learnt until then",
    )
    yield table(
        "electrode health on recordings",
        (_blamed(folder, *series) for series in dict.fromkeys(SERIES + PRESSED)),
        "voltages only, the reference from the first 20 untouched frames and not followed; "
        "nothing is known of these skins' electrodes, so an alarm may be right",
        across="frames",
    )


Stage = defaultdict[str, list[float]]
"""Of one stage, each a list: presses ``missed`` by m, cuts ``noticed``, ``ghosts``, ``extra``."""


def _cuts() -> Iterator[dict[str, Any]]:
    """No electrode, one and then two cut off while running."""
    for name, preset in CUT_SKINS:
        prepared = prepare(Skin.load(name))
        stages = [Stage(list) for _ in range(3)]
        for seed in SEEDS:
            _cut_run(prepared, preset, seed, stages)
        whole = float(np.nanmedian(stages[0]["missed"]))
        for number, stage in enumerate(stages):
            median, p90 = np.nanpercentile(stage["missed"], (50, 90))
            yield {
                "skin": f"{name}, {preset}",
                "cut": number,
                "noticed after frames": max(map(int, stage["noticed"]), default="–"),
                "median error mm": mm(median)[0],
                "of the whole skin's": round(float(median) / whole, 2),
                "p90 mm": mm(p90, digits=1)[0],
                "not found": int(np.isnan(stage["missed"]).sum()),
                "ghosts at the cut": int(sum(stage["ghosts"])),
                "ghosts beside presses": int(sum(stage["extra"])),
            }


def _cut_run(prepared: Prepared, preset: str, seed: int, stages: list[Stage]) -> None:
    random = np.random.default_rng(seed)
    first, second = random.choice(prepared.skin.n_electrodes, 2, replace=False).tolist()
    spots = evenly(random, PRESSES, REACH).tolist()
    rig, pipeline = Rig(prepared.skin, preset, seed), Pipeline(prepared)
    rig.push(pipeline, 50)
    for stage, cut in zip(stages, ((), (first,), (first, second)), strict=True):
        faults = Faults(cut=frozenset(cut))
        idle = rig.push(pipeline, 6, (), faults)
        stage["ghosts"].append(sum(len(result.touches) for result in idle))
        if cut:
            sick = [{e.electrode for e in r.health.sick} if r.health else () for r in idle]
            stage["noticed"].append(next((n for n, s in enumerate(sick, 1) if cut[-1] in s), 99))
        for x, y in spots:
            touches = rig.push(pipeline, 5, [Press(x, y, FORCE, PROBE)], faults)[-1].touches
            near = nearest(touches, (x, y))
            stage["missed"].append(np.nan if near is None else gap(near, (x, y)))
            stage["extra"].append(max(0, len(touches) - 1))
            rig.push(pipeline, 6, (), faults)


def _alarms(name: str, preset: str, *, pressed: bool) -> dict[str, Any]:
    """Electrodes called sick that are not, while nothing and while much touches."""
    prepared = prepare(Skin.load(name))
    rig, pipeline = Rig(prepared.skin, preset, 7), Pipeline(prepared)
    random = np.random.default_rng(7)
    rig.push(pipeline, 40)
    reach = 0.95 * float(np.linalg.norm(prepared.skin.electrode_centres, axis=1).min())
    sick, named, touched, frames = 0, set(), 0, 0
    while frames < WELL_FRAMES:
        count = int(random.integers(1, 11))
        presses = _random_presses(random, reach) if pressed else ()
        for result in rig.push(pipeline, count, presses):
            blamed = result.health.sick if result.health else ()
            sick += bool(blamed)
            named |= {e.text for e in blamed}
            touched += bool(result.touches)
        frames += count
    return {
        "skin": f"{name}, {preset}",
        "run": "pressed" if pressed else "idle",
        "frames": frames,
        "frames with a sick electrode": sick,
        "electrodes": len(named),
        "frames with touches": touched,
    }


def _random_presses(random: np.random.Generator, reach: float) -> tuple[Press, ...]:
    spots: list[Floats] = list(evenly(random, int(random.integers(0, 4)), reach))
    apart = all(np.linalg.norm(a - b) > 3 * PROBE for a, b in pairwise(spots))
    chosen = spots if apart else spots[:1]
    return tuple(Press(*p.tolist(), float(random.uniform(1, 12)), PROBE) for p in chosen)


def _read(folder: Path, name: str, key: str) -> tuple[Pattern, Floats]:
    """Pattern and (n_frames, n_rows) of the rows that live; a reversed one is the same."""
    with np.load(folder / f"{name}.npz") as file:
        values = np.asarray(file[key]).real.astype(float)
        n = values.shape[1]
        drive, measure = file["inj"][:n].astype(int), file["meas"][:n].astype(int)
        good = file["valid"][:n] if "valid" in file.files else np.ones(n, bool)
    good = good & np.isfinite(values).all(axis=0) & (np.ptp(values, axis=0) > 0)
    ends = undirected(drive, measure)
    good &= np.array([len(set(row)) == 4 for row in ends.tolist()])
    _, first = np.unique(ends[good], axis=0, return_index=True)
    kept: NDArray[Any] = np.flatnonzero(good)[np.sort(first)]
    return Pattern.from_tables(drive[kept], measure[kept]), values[:, kept]


def _drifted(name: str, pattern: Pattern, values: Floats) -> dict[str, Any]:
    """How far an untouched frame is from the reference, first and followed."""
    reference = Reference.of(values[:IDLE])
    baseline = Baseline(reference)
    none = np.zeros(pattern.n_meas, bool)
    noise = np.sqrt(np.mean(np.diff(values, axis=0) ** 2, axis=0) / 2)
    noise = np.maximum(noise, 0.5 * np.median(noise))
    off, modes, gain = [], np.zeros((pattern.n_meas, 0)), reference.mean[:, None]
    blind = _plain(gain, noise)
    for number, frame in enumerate(values[IDLE:]):
        first, last = (frame - reference.mean) / noise, (frame - baseline.mean) / noise
        off.append([rms(x) for x in (first, blind(first), last, blind(last))])
        if baseline.push(frame, none, float(number), touched=False):
            modes = baseline.idle.modes(lambda: np.zeros((pattern.n_meas, 1)))
            blind = _plain(np.hstack([gain, modes]), noise)
    part = max(len(values) // 20, 1)
    start, end = values[:part].mean(axis=0), values[-part:].mean(axis=0)
    medians = [round(float(m), 2) for m in np.median(off, axis=0)]
    names = ("first reference", "its common modes out", "followed", "followed, modes out")
    return {
        "recording": name.split("/")[1],
        "frames": len(values),
        "change %": round(float(100 * np.linalg.norm(end - start) / np.linalg.norm(start)), 1),
        **dict(zip(names, medians, strict=True)),
        "modes": 1 + modes.shape[1],
    }


def _plain(directions: Floats, noise: Floats) -> NuisanceSubspace:
    return NuisanceSubspace.of(directions / noise[:, None], np.eye(len(noise)))


def _blamed(folder: Path, name: str, key: str) -> dict[str, Any]:
    """Electrodes that health blames in recordings of skins that were well."""
    pattern, values = _read(folder, name, key)
    idle = values if key != "v_down" else _read(folder, name, "v_up")[1]
    reference, none = Reference.of(idle[:IDLE]), np.zeros(pattern.n_meas, bool)
    monitor = Monitor(pattern, reference, reference.mean, unusable=none.copy())
    health = [monitor.push(v, none, float(k)) for k, v in enumerate(values)]
    named = sorted({f"E{e.electrode + 1} {e.state}" for h in health for e in h.sick})
    return {
        "recording": name.split("/")[1],
        "rows": pattern.n_meas,
        "frames": "pressed" if (name, key) in PRESSED else "untouched",
        "how many": len(values),
        "with a sick electrode": sum(bool(h.sick) for h in health),
        "rows lost, median": int(np.median([h.lost.sum() for h in health])),
        "which": ", ".join(named[:4]) + (" …" if len(named) > 4 else "") or "–",
    }
