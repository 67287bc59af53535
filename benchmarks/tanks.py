"""Scores in the tank of the Kuopio challenge: its four samples, and simulated ones."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np

from from_examples import load_example
from report import Report
from simulated_tanks import simulated
from tomoskin.core import DataError

ROOT = Path(__file__).resolve().parents[1]
SHARED = ROOT.parent / "shared" / "data"
LEVELS = range(1, 8)
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
                "s: mean of one segmentation",
                f"simulated: seeds {SEEDS.start} to {SEEDS.stop - 1}",
            ),
        ),
    )


def _rows(example: Any, name: str, tanks: Iterable[Any]) -> list[tuple[Any, ...]]:
    results = [[example.scored(tank, level) for level in LEVELS] for tank in tanks]
    scores = np.array([[result.scores for result in of_tank] for of_tank in results])
    seconds = float(np.mean([result.seconds for of_tank in results for result in of_tank]))
    rows = []
    for k, method in enumerate(("shapes", "linear and Otsu", "water only")):
        of_level = scores[..., k].mean(axis=0)
        mean = float(of_level.mean())
        taken = f"{seconds:.1f}" if k == 0 else ""
        rows.append(
            (
                name,
                method,
                *(f"{s:.3f}" for s in of_level),
                f"{mean:.3f}",
                f"{21 * mean:.2f}",
                taken,
            )
        )
    return rows
