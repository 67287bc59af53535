"""Soft bodies: stiff balls felt through the skin at random places, expressions of a face."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from types import ModuleType
from typing import Any

import numpy as np

from bench_rig import INSIDE_90, distance, drawn, gap, load_example, nearest
from report import Report, mm, table
from tomoskin import Skin
from tomoskin.pipeline import prepare
from tomoskin.twin import Press, SteppedSkin, TwinSettings

SEEDS = (11, 12, 13)
PLACEMENTS = 100
EFFECTS = (1.0, 0.5)
REACH, APART = 35e-3, 30e-3
WITHIN = 8e-3
FOAMS, SHEETS, PRESSES, SEED = (3e-3, 15e-3, 30e-3), (8, 16), 40, 6101
"""Thickness, m; electrodes; presses of each, from a seed that nothing was chosen on."""

POLARISED = (0.0, 0.5e-3, 1e-3, 2e-3, 4e-3)


def run() -> Iterator[Report]:
    seeds = f"seeds {', '.join(map(str, SEEDS))}"
    palpation, face = load_example("fig62_palpation"), load_example("fig64_face")
    yield table(
        "two stiff balls under a plate",
        (_felt(palpation, effect) for effect in EFFECTS),
        f"places even over ±{1e3 * REACH:g} mm, at least {1e3 * APART:g} mm apart; {seeds} in turn",
        "10-bit read-out, 64 readings a sample, means of 40 frames; known weight ± 2 %",
    )
    yield table(
        "presses on soft foam",
        (
            _pressed(count, foam, named=named)
            for count in SHEETS
            for foam in FOAMS
            for named in (False, True)
        ),
        f"textile twin, springs {' '.join(f'{1e3 * foam:g}' for foam in FOAMS)} mm long; {PRESSES} "
        f"presses of 2 to 4 N, tips of 8 to 15 mm radius, up to 85 mm from the middle; seed {SEED}",
        "off: mean distance of the nearest touch; the last of eight frames",
        across="layer in the skin file",
    )
    yield table(
        "six expressions of a face",
        _expressions(face),
        f"{seeds}: {face.LEARNT} sessions learnt, {face.ASKED} asked, {face.RUNS} runs each; "
        "electrodes put on again each time",
    )


def _pressed(electrodes: int, foam: float, *, named: bool) -> dict[str, Any]:
    """Presses on ``foam`` m, whose thickness the skin file may name."""
    skin = Skin.load(f"textile-disc-{electrodes}")
    if named:
        skin = skin.altered({"surface": {"layer": f"{1e3 * foam:g} mm"}})
    given = TwinSettings.preset("textile", SEED)
    soft = {k: replace(getattr(given, k), thickness=foam) for k in ("contact", "material")}
    given, random = replace(given, **soft), np.random.default_rng(SEED)
    twin = SteppedSkin(prepare(skin), given)
    away, inside = [], 0
    for trial in range(PRESSES):
        twin.reset(SEED + trial)
        (press,) = drawn(random, 1)
        for part in (0.3, 0.6, *[1.0] * 6):
            touches = twin.step(
                (Press(press.x, press.y, part * press.force, press.radius),)
            ).touches
        if (touch := nearest(touches, press)) is not None:
            away.append(gap(touch, press))
            inside += distance(touch.detection, press.x, press.y) < INSIDE_90
    return {
        "electrodes": electrodes,
        "foam, mm": 1e3 * foam,
        "layer in the skin file": "yes" if named else "no",
        "found": f"{len(away)} of {PRESSES}",
        "off, mm": round(1e3 * float(np.mean(away)), 2),
        "in the 90 % ellipse": f"{inside / len(away):.0%}",
    }


def _felt(example: ModuleType, effect: float) -> dict[str, Any]:
    """Two balls of 10 and 8 mm, ``PLACEMENTS`` times over three twins."""
    beds = [example.Bed(seed, effect) for seed in SEEDS]
    palpation = example.Palpation(beds[0].skin)
    away, count = [], []
    for trial in range(PLACEMENTS):
        which = trial % len(SEEDS)
        balls = _placed(example, np.random.default_rng([SEEDS[which], trial]))
        found = palpation(beds[which].stages(balls, trial))
        away.append(example.errors(found, balls))
        count.append(len(found))
    both = (np.array(away) < WITHIN).all(axis=1)
    large, small = np.array(away).T
    return {
        "change of conductivity per compression": effect,
        "placements": PLACEMENTS,
        "both within 8 mm": f"{both.mean():.0%}",
        "and no third": f"{(both & (np.array(count) == len(balls))).mean():.0%}",
        "10 mm: median, mm": mm(np.median(large), digits=1)[0],
        "8 mm: median, mm": mm(np.median(small), digits=1)[0],
        "8 mm: p95, mm": mm(np.percentile(small, 95), digits=1)[0],
    }


def _placed(example: ModuleType, random: np.random.Generator) -> tuple[Any, ...]:
    """A ball of each size, far enough apart."""
    while True:
        one, other = random.uniform(-REACH, REACH, (2, 2))
        if np.hypot(*(one - other)) >= APART:
            return example.between(*one, example.LARGE), example.between(*other, example.SMALL)


def _expressions(example: ModuleType) -> Iterator[dict[str, Any]]:
    """Runs through six expressions, by what direct current suffers from its electrodes."""
    all_sessions = [(seed, example.sessions_of(seed)) for seed in SEEDS]
    for polarised in (*POLARISED, None):
        direct = polarised is not None
        if direct:
            example.POLARISED = polarised
        name = f"direct, {1e3 * polarised:g} mV on each reading" if direct else "complex"
        right = np.concatenate([example.told(s, seed, direct=direct) for seed, s in all_sessions])
        yield {
            "data": name,
            "runs": len(right),
            "right": f"{right.mean():.1%}",
            "runs with 5 of 6": f"{example.whole_runs(right):.0%}",
            **{n: f"{p:.0%}" for n, p in zip(example.NAMES, right.mean(axis=0), strict=True)},
        }
