"""Scores in the tank of the Kuopio challenge: its four samples, and simulated ones."""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from scipy.stats import rankdata

from report import Report, recordings, table
from rig import load_example
from simulated_tanks import simulated
from tomoskin.core import FloatArray

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


def run(data: Path | None) -> Iterator[Report]:
    """Segment tanks at every level; ``data`` is the folder of public recordings."""
    file = Path("ktc2023_tank32") / "train.npz"
    example = load_example("ktc2023")
    measured = list(example.samples(recordings(data, str(file)) / file))
    inj, mpat = measured[0].inj, measured[0].mpat
    groups: dict[str, list[list[Judged]]] = {
        "4 measured": [[judged(example, tank, level) for tank in measured] for level in LEVELS],
        f"{TANKS} simulated": [_simulated(example, level, inj, mpat) for level in LEVELS],
    }
    yield table(
        "score, 1 is best",
        (row for name, group in groups.items() for row in _scores(name, group)),
        "times 21: the challenge's sum over three samples at each of seven levels",
        "±: standard error of the mean over tanks; simulated ones are others at each level",
        "seconds: mean processor time of one segmentation",
    )
    yield table(
        "where it is sure",
        (row for name, group in groups.items() for row in _certainty(name, group)),
        "ranked: how often a wrong pixel is less sure than a right one; 0.5 is chance",
        "loss: mean of −log₂ of the probability given to the true label",
        "constant: the same if every label counted as wrong as often as labels are",
    )


def _simulated(example: Any, level: int, inj: FloatArray, mpat: FloatArray) -> list[Judged]:
    seeds = range(6000 + 100 * level, 6000 + 100 * level + TANKS)
    tanks = ((seed, simulated(seed, inj, mpat)) for seed in seeds)
    return [
        judged(example, example.Sample(str(seed), t.u, t.u_ref, inj, mpat, t.truth), level)
        for seed, t in tanks
    ]


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


def _scores(name: str, group: Sequence[Sequence[Judged]]) -> Iterator[dict[str, Any]]:
    """Mean and its standard error at each level, and over all."""
    for k, method in enumerate(METHODS):
        scores = np.array([[tank.scores[k] for tank in tanks] for tanks in group])
        error = scores.std(axis=1, ddof=1) / np.sqrt(scores.shape[1])
        means = [*scores.mean(axis=1), scores.mean()]
        errors = [*error, np.sqrt((error**2).sum()) / len(error)]
        values = [f"{m:.3f} ± {e:.3f}" for m, e in zip(means, errors, strict=True)]
        yield _by_level(name, method, values) | {"times 21": f"{21 * scores.mean():.2f}"}
    taken = np.array([np.mean([tank.seconds for tank in tanks]) for tanks in group])
    yield _by_level(name, "seconds", [f"{s:.1f}" for s in (*taken, taken.mean())])


def _certainty(name: str, group: Sequence[Sequence[Judged]]) -> Iterator[dict[str, Any]]:
    for what in ("wrong", "ranked", "loss", "constant"):
        means = np.array([np.mean([getattr(tank, what) for tank in tanks]) for tanks in group])
        yield _by_level(name, what, [f"{m:.3f}" for m in (*means, means.mean())])


def _by_level(name: str, method: str, values: Sequence[str]) -> dict[str, Any]:
    columns = (*(f"level {n}" for n in LEVELS), "mean")
    return {"tanks": name, "method": method, **dict(zip(columns, values, strict=True))}
