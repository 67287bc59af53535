"""Scores in the tank of the Kuopio challenge: its four samples, and simulated ones."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from scipy.stats import rankdata

from from_examples import load_example
from report import Report
from simulated_tanks import simulated
from tomoskin.core import DataError, FloatArray

ROOT = Path(__file__).resolve().parents[1]
SHARED = ROOT.parent / "shared" / "data"
LEVELS = range(1, 8)
METHODS = ("shapes", "linear and Otsu", "water only")
TANKS = 8
"""Simulated tanks at a level. Each has its own; settings were chosen on others."""

COARSE = 64
"""Pixels a side where certainty is judged."""


@dataclass(frozen=True, eq=False)
class Judged:
    """One tank at one level.

    Attributes
    ----------
    scores
        (3,) in the order of METHODS.
    seconds
        Of processor time, of one segmentation.
    wrong
        Part of the pixels with a wrong label.
    ranked
        How often a wrong pixel is less sure than a right one; 0.5 is chance.
    loss, constant
        Mean of −log₂ of the probability that the true label was given, in bits, and what it were
        if each label counted as wrong as often as labels are.
    """

    scores: FloatArray
    seconds: float
    wrong: float
    ranked: float
    loss: float
    constant: float


def run(data: Path | None) -> tuple[Report, ...]:
    """Segment tanks at every level; ``data`` is the folder of public recordings."""
    file = (data or SHARED) / "ktc2023_tank32" / "train.npz"
    if not file.exists():
        raise DataError("expected the challenge's training data", where=str(file), hint="--data")
    example = load_example("ktc2023")
    measured = list(example.samples(file))
    inj, mpat = measured[0].inj, measured[0].mpat
    groups: list[tuple[str, list[list[Judged]]]] = [
        ("4 measured", [[judged(example, tank, level) for tank in measured] for level in LEVELS]),
        (f"{TANKS} simulated", [_simulated(example, level, inj, mpat) for level in LEVELS]),
    ]
    columns = ("tanks", "method", *(f"level {n}" for n in LEVELS), "mean", "times 21")
    scores = [row for name, group in groups for row in _scores(name, group)]
    certain = [row for name, group in groups for row in _certainty(name, group)]
    return (
        Report(
            "score, 1 is best",
            columns,
            tuple(scores),
            (
                "times 21: the challenge's sum over three samples at each of seven levels",
                "±: standard error of the mean over tanks; simulated ones are others at each level",
                "seconds: mean processor time of one segmentation",
            ),
        ),
        Report(
            "where it is sure",
            columns[:-1],
            tuple(certain),
            (
                "ranked: how often a wrong pixel is less sure than a right one; 0.5 is chance",
                "loss: mean of −log₂ of the probability given to the true label",
                "constant: the same if every label counted as wrong as often as labels are",
            ),
        ),
    )


def _simulated(example: Any, level: int, inj: FloatArray, mpat: FloatArray) -> list[Judged]:
    tanks = ((seed, simulated(seed, inj, mpat)) for seed in seeds(level))
    return [
        judged(example, example.Sample(str(seed), t.u, t.u_ref, inj, mpat, t.truth), level)
        for seed, t in tanks
    ]


def seeds(level: int) -> range:
    """Seeds of a level's simulated tanks."""
    return range(6000 + 100 * level, 6000 + 100 * level + TANKS)


def judged(example: Any, tank: Any, level: int) -> Judged:
    """Segment one tank without the electrodes that ``level`` leaves out."""
    keep = example.kept(tank.inj, tank.mpat, level)
    begun = time.process_time()
    found = example.regions(*example.checked(tank.u, tank.u_ref, tank.inj, tank.mpat, keep))
    labels = example.labelled(found)
    seconds = time.process_time() - begun
    linear = example.linear(tank.u, tank.u_ref, tank.inj, tank.mpat, keep)
    pictures = (labels, linear, np.zeros_like(labels))
    scores = np.array([example.score(picture, tank.truth) for picture in pictures])
    points, inside = example.pixels(COARSE)
    step = example.PIXELS // COARSE
    truth = np.asarray(tank.truth)[step // 2 :: step, step // 2 :: step][inside]
    return Judged(scores, seconds, *certainty(found, points, truth))


def certainty(found: Any, points: FloatArray, truth: Any) -> tuple[float, float, float, float]:
    """Part of the ``points`` that is wrong, and the three numbers of :class:`Judged` about it."""
    wrong = found.at(points) != truth
    rank, n = rankdata(found.entropy(points)), int(wrong.sum())
    above = rank[wrong].sum() - n * (n + 1) / 2
    given = found.probability(points)[np.arange(len(truth)), truth]
    often = (n + 1) / (len(truth) + 2)
    constant = -often * np.log2(often / 2) - (1 - often) * np.log2(1 - often)
    ranked = above / (n * (len(truth) - n)) if n else 1.0
    return float(wrong.mean()), float(ranked), float(-np.log2(given + 1e-3).mean()), float(constant)


def _scores(name: str, group: Sequence[Sequence[Judged]]) -> list[tuple[Any, ...]]:
    scores = np.array([[tank.scores for tank in tanks] for tanks in group])
    rows = [
        (name, method, *_spread(scores[..., k]), f"{21 * scores[..., k].mean():.2f}")
        for k, method in enumerate(METHODS)
    ]
    taken = np.array([[tank.seconds for tank in tanks] for tanks in group]).mean(axis=1)
    means = (*taken, taken.mean())
    return [*rows, (name, "seconds", *(f"{second:.1f}" for second in means), "")]


def _certainty(name: str, group: Sequence[Sequence[Judged]]) -> list[tuple[Any, ...]]:
    rows = []
    for what in ("wrong", "ranked", "loss", "constant"):
        values = np.array([[getattr(tank, what) for tank in tanks] for tanks in group])
        means = values.mean(axis=1)
        rows.append((name, what, *(f"{m:.3f}" for m in means), f"{means.mean():.3f}"))
    return rows


def _spread(scores: FloatArray) -> list[str]:
    """Mean and its standard error of (levels, tanks): each level, and all."""
    error = scores.std(axis=1, ddof=1) / np.sqrt(scores.shape[1])
    means = [*scores.mean(axis=1), scores.mean()]
    errors = [*error, np.sqrt((error**2).sum()) / len(error)]
    return [f"{m:.3f} ± {e:.3f}" for m, e in zip(means, errors, strict=True)]
