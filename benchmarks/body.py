"""Soft bodies: stiff balls felt through the skin at random places, expressions of a face."""

from __future__ import annotations

from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np

from from_examples import load_example
from report import Report

SEEDS = (11, 12, 13)
PLACEMENTS = 100
EFFECTS = (1.0, 0.5)
REACH, APART = 35e-3, 30e-3
WITHIN = 8e-3
POLARISED = (0.0, 0.5e-3, 1e-3, 2e-3, 4e-3)


def run(data: Path | None) -> tuple[Report, ...]:
    """Both tables; no recording is needed."""
    del data
    return palpation(), face()


def palpation() -> Report:
    """Two balls of 10 and 8 mm, ``PLACEMENTS`` times over three twins."""
    example = load_example("fig62_palpation")
    rows = [(effect, *_felt(example, effect)) for effect in EFFECTS]
    return Report(
        "two stiff balls under a plate",
        (
            "change of conductivity per compression",
            "placements",
            "both within 8 mm",
            "and no third",
            "10 mm: median, mm",
            "8 mm: median, mm",
            "8 mm: p95, mm",
        ),
        tuple(rows),
        (
            f"places even over ±{1e3 * REACH:g} mm, at least {1e3 * APART:g} mm apart; "
            f"seeds {', '.join(map(str, SEEDS))} in turn",
            "10-bit read-out, 64 readings a sample, means of 40 frames; known weight ± 2 %",
        ),
    )


def _felt(example: ModuleType, effect: float) -> tuple[Any, ...]:
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
    only = both & (np.array(count) == len(balls))
    large, small = 1e3 * np.array(away).T
    return (
        PLACEMENTS,
        f"{both.mean():.0%}",
        f"{only.mean():.0%}",
        round(float(np.median(large)), 1),
        round(float(np.median(small)), 1),
        round(float(np.percentile(small, 95)), 1),
    )


def _placed(example: ModuleType, random: np.random.Generator) -> tuple[Any, ...]:
    """A ball of each size, far enough apart."""
    while True:
        one, other = random.uniform(-REACH, REACH, (2, 2))
        if np.hypot(*(one - other)) >= APART:
            return example.between(*one, example.LARGE), example.between(*other, example.SMALL)


def face() -> Report:
    """Runs through six expressions, by what direct current suffers from its electrodes."""
    example = load_example("fig64_face")
    all_sessions = [(seed, example.sessions_of(seed)) for seed in SEEDS]
    rows = []
    for polarised in POLARISED:
        example.POLARISED = polarised
        name = f"direct, {1e3 * polarised:g} mV on each reading"
        rows.append((name, *_told(example, all_sessions, direct=True)))
    rows.append(("complex", *_told(example, all_sessions, direct=False)))
    return Report(
        "six expressions of a face",
        ("data", "runs", "right", "runs with 5 of 6", *example.NAMES),
        tuple(rows),
        (
            f"seeds {', '.join(map(str, SEEDS))}: {example.LEARNT} sessions learnt, "
            f"{example.ASKED} asked, {example.RUNS} runs each; electrodes put on anew each time",
        ),
    )


def _told(example: ModuleType, all_sessions: list[Any], *, direct: bool) -> tuple[Any, ...]:
    right = np.concatenate([example.told(s, seed, direct=direct) for seed, s in all_sessions])
    each = (f"{part:.0%}" for part in right.mean(axis=0))
    return len(right), f"{right.mean():.1%}", f"{example.whole_runs(right):.0%}", *each
