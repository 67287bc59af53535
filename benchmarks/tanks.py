"""Scores in the tank of the Kuopio challenge: its four samples, and simulated ones."""

from __future__ import annotations

import time
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np

from from_examples import load_example
from report import Report
from sampled_tanks import sampled
from simulated_tanks import simulated
from tomoskin.core import DataError, FloatArray

ROOT = Path(__file__).resolve().parents[1]
SHARED = ROOT.parent / "shared" / "data"
LEVELS = range(1, 8)
METHODS = ("shapes", "sampled regions", "linear and Otsu", "water only")
SEEDS = range(2000, 2010)
"""Simulated tanks; those that settings were chosen on are others."""


def run(data: Path | None) -> tuple[Report, ...]:
    """Segment every tank at every level; ``data`` is the folder of public recordings."""
    file = (data or SHARED) / "ktc2023_tank32" / "train.npz"
    if not file.exists():
        raise DataError("expected the challenge's training data", where=str(file), hint="--data")
    example = load_example("ktc2023")
    measured = list(example.samples(file))
    inj, mpat = measured[0].inj, measured[0].mpat
    twins = []
    for seed in SEEDS:
        tank = simulated(seed, inj, mpat)
        twins.append(example.Sample(str(seed), tank.u, tank.u_ref, inj, mpat, tank.truth))
    rows = [row for name, of in (("measured", measured), ("simulated", twins))
            for row in _rows(example, f"{len(of)} {name}", of)]  # fmt: skip
    columns = ("tanks", "method", *(f"level {n}" for n in LEVELS), "mean", "times 21", "s")
    return (
        Report(
            "score, 1 is best",
            columns,
            tuple(rows),
            (
                "times 21: the challenge's sum over three samples at each of seven levels",
                "±: standard error of the mean over tanks",
                "s: mean processor time of one segmentation",
                f"simulated: seeds {SEEDS.start} to {SEEDS.stop - 1}",
            ),
        ),
    )


def _rows(example: Any, name: str, tanks: Iterable[Any]) -> list[tuple[Any, ...]]:
    results = [[_scored(example, tank, level) for level in LEVELS] for tank in tanks]
    scores = np.array([[scores for scores, _ in of_tank] for of_tank in results])
    seconds = np.mean([taken for of_tank in results for _, taken in of_tank], axis=0)
    return [
        (name, method, *_spread(scores[..., k]), f"{seconds[k]:.1f}" if k < len(seconds) else "")
        for k, method in enumerate(METHODS)
    ]


def _scored(example: Any, tank: Any, level: int) -> tuple[list[float], tuple[float, float]]:
    """Scores in the order of METHODS, and processor seconds of the first two of them."""
    begun = time.process_time()
    labels = sampled(example, tank, level)
    taken = time.process_time() - begun
    result = example.scored(tank, level)
    shapes, linear, water = result.scores
    scores = [shapes, example.score(labels, tank.truth), linear, water]
    return scores, (result.seconds, taken)


def _spread(scores: FloatArray) -> tuple[str, ...]:
    """Mean and its standard error of (tanks, levels): each level, all, and the challenge's sum."""
    each = np.column_stack([scores, scores.mean(axis=1)])
    error = each.std(axis=0, ddof=1) / np.sqrt(len(each))
    columns = [f"{m:.3f} ± {e:.3f}" for m, e in zip(each.mean(axis=0), error, strict=True)]
    return *columns, f"{21 * scores.mean():.2f}"
