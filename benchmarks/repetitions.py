"""Classes of things that are repeated: what is said of them, on sets that nothing was chosen on."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from classes import readings
from report import Floats, Report, recordings, table
from tomoskin import ForwardModel, Skin
from tomoskin.extras.classes import Classifier

CLASSES, UNTAUGHT = 17, 5
SUBJECTS = {"even": range(20, 24), "uneven": range(24, 27)}
"""Seeds on which nothing was chosen; 0 to 4 were in view while the method was made."""

VARIES = {"even": 0.55, "uneven": 0.9}
"""By how much a repetition differs from the next, part of how gestures differ."""

Set = tuple[Floats, np.ndarray]


def run(data: Path | None) -> Iterator[Report]:
    """Measure on simulated subjects, and on the public sets in ``data``."""
    data = recordings(data)
    yield table(
        "taught in one trial, asked in the next",
        ({"set": name, **_judged(*both)} for name, both in _sets(data)),
        f"{CLASSES - UNTAUGHT} of {CLASSES} classes are taught; LDA: covariance drawn to a sphere "
        "by a fifth, twenty lines of numpy",
        "untaught: frames of the other classes that are unknown; predicted: what `calibrate class` "
        "says of that",
        "simulated subjects: five repetitions of 25 frames a trial, 8 electrodes, seed in the name",
    )


def _sets(data: Path) -> Iterator[tuple[str, tuple[Set, Set]]]:
    for kind, seeds in SUBJECTS.items():
        for seed in seeds:
            yield f"{kind} subject {seed}", _subject(seed, VARIES[kind])
    yield "hydrogel, 41 places five times", _hydrogel(data / "eskin_hydrogel_rect8", 5)
    for batch, seed in ((2, 0), (2, 1), (1, 7)):
        name = f"six points, batch {batch}, seed {seed}"
        yield name, _six_points(data / "eskin_membrane8_sixpoint", batch, seed)


def _judged(taught: Set, asked: Set) -> dict[str, Any]:
    (dv, truth), (more, others) = taught, asked
    known, own = truth < CLASSES - UNTAUGHT, others < CLASSES - UNTAUGHT
    made = Classifier.fit(dv[known], [f"{k:02d}" for k in truth[known]])
    answers, strange = made.predict(more[own]), made.predict(more[~own])
    right = np.array([int(name) for name in answers.label]) == others[own]
    plain = _lda(dv[known], truth[known], more[own]) == others[own]
    said = answers.probability.mean()
    return {
        "right": f"{right.mean():.2f}",
        "LDA": f"{plain.mean():.2f}",
        "said": f"{said:.2f}",
        "left out": f"{made.right:.2f}",
        "unknown": f"{answers.rejected.mean():.0%}",
        "untaught": f"{strange.rejected.mean():.0%}",
        "predicted": f"{made.noticed:.0%}",
    }


def _lda(dv: Floats, truth: np.ndarray, asked: Floats) -> np.ndarray:
    scale = dv.std(axis=0) + 1e-12
    x, y = dv / scale, asked / scale
    means = np.stack([x[truth == k].mean(axis=0) for k in range(CLASSES - UNTAUGHT)])
    residual = x - means[truth]
    raw = residual.T @ residual / len(x)
    covariance = 0.8 * raw + 0.2 * np.trace(raw) / len(raw) * np.eye(len(raw))
    weights = np.linalg.solve(covariance, means.T)
    return np.asarray((y @ weights - 0.5 * (means.T * weights).sum(axis=0)).argmax(axis=1))


def _subject(seed: int, varies: float) -> tuple[Set, Set]:
    """Two trials of gestures: each a few muscles under the band, held again and again, each time
    a little otherwise."""
    skin = Skin.load("textile-disc-8").altered({"mesh": {"cells": 600}})
    mesh, rng = skin.mesh(), np.random.default_rng(seed)
    model = ForwardModel(mesh, skin.pattern(), skin.contact_impedance, skin.current)
    jacobian = model.jacobian(skin.conductivity)

    def changes(n: int) -> Floats:
        out = np.zeros((n, len(jacobian)))
        for row in out:
            places, sizes = rng.uniform(-0.075, 0.075, (6, 2)), rng.normal(size=6)
            near = ((mesh.centroids - places[:, None]) ** 2).sum(axis=2)
            row[:] = jacobian @ (sizes @ np.exp(-near / (2 * 0.03**2)))
        return np.asarray(out / np.sqrt((out**2).mean(axis=1, keepdims=True)))

    gestures, ways = changes(CLASSES), changes(8) / np.sqrt(8)
    trials = []
    for _ in range(2):
        band = 0.2 * rng.normal(size=8) @ ways
        today = gestures + 0.25 * varies * rng.normal(size=(CLASSES, 8)) @ ways
        dv, truth, drift = [], [], np.zeros(8)
        for _ in range(5):
            for number in rng.permutation(CLASSES):
                drift = 0.97 * drift + 0.12 * rng.normal(size=8)
                again = varies * (rng.normal(size=8) @ ways + 0.5 * changes(1)[0])
                wavers = np.zeros(8)
                for _ in range(25):
                    wavers = 0.9 * wavers + 0.12 * varies * rng.normal(size=8)
                    moved = (drift + wavers) @ ways + 0.08 * rng.normal(size=len(jacobian))
                    dv.append(band + today[number] + again + moved)
                    truth.append(number)
        trials.append((np.array(dv), np.array(truth)))
    return trials[0], trials[1]


def _hydrogel(folder: Path, seed: int) -> tuple[Set, Set]:
    """Presses of places, the first three of each taught."""
    with np.load(folder / "rect16_repeat50x5.npz") as kept:
        v = kept["v"].astype(float)
    places = np.random.default_rng(seed).permutation(len(v))[:CLASSES]
    v = v[places] - v[:, :3].mean(axis=(0, 1))
    first, last = (
        (np.concatenate(list(v.transpose(1, 0, 2)[some])), np.tile(np.arange(CLASSES), n))
        for some, n in ((slice(0, 3), 3), (slice(3, 5), 2))
    )
    return first, last


def _six_points(folder: Path, batch: int, seed: int) -> tuple[Set, Set]:
    """Combinations of points as classes, the first six tenths of the frames taught."""
    dv, flags = readings(folder, batch, smooth=True)
    code = (flags @ 2.0 ** np.arange(6)).astype(int)
    often = np.flatnonzero(np.bincount(code) >= 8)
    place = np.full(64, -1)
    place[np.random.default_rng(seed).permutation(often)[:CLASSES]] = np.arange(CLASSES)
    truth, early = place[code], np.arange(len(dv)) < 0.6 * len(dv)
    parts = (early & (truth >= 0), ~early & (truth >= 0))
    first, last = ((dv[part], truth[part]) for part in parts)
    return first, last
