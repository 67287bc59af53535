"""Places of touches from labelled presses: the locator against a plain Gaussian process."""

from __future__ import annotations

import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from report import Report
from tomoskin import Locator
from tomoskin.core import DataError
from tomoskin.touch.locator.kernel import squared_distances
from tomoskin.touch.locator.process import Process

SHARED = Path(__file__).parents[2] / "shared" / "data"

SKINS = {"noPattern": 2.28, "fullCB": 6.74, "parallel": 3.13, "concentric": 4.99, "radial": 3.84}
"""Five skins with what their authors' network reaches after 2,000 presses, mm."""

COUNTS = {25: 2, 50: 2, 100: 2, 200: 1, 500: 1, 1000: 1, 1800: 1}
"""Presses learnt from, and how often it is repeated with other presses."""

TESTED = 225
ROUND = {
    "round16_single550": (2.5, 5.5),
    "round16_single500_ohmc": (3.0, 3.8),
    "round8_single500_ohmc": (2.6, 2.6),
}
DRIFTING, AHEAD = "rect8_single10k", 300
ENDS = (1700, 3300, 4900, 6500, 7300, 7800)
PASTS = {1500: 10.5, 300: 14.0}

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Score:
    """Of one learning: mm, part inside the 90 % ellipse, processor seconds and milliseconds."""

    errors: Floats
    plain: Floats
    held: float
    fit: float
    frame: float


def run(data: Path | None) -> tuple[Report, ...]:
    """Learn from the public sets in ``data``, by default those beside the checkout."""
    data = data or SHARED
    if not data.is_dir():
        raise DataError("expected the public recordings", where=str(data), hint="--data FOLDER")
    return (
        *_five_skins(data / "eskin_varsens16"),
        _two_splits(data),
        _another_session(data),
        _drift(data),
    )


def _five_skins(folder: Path) -> Iterator[Report]:
    rows, skins = [], []
    for count, repeats in COUNTS.items():
        found = {
            name: [_of(_random(folder / f"{name}.npz", count, seed)) for seed in range(repeats)]
            for name in SKINS
        }
        every = [score for scores in found.values() for score in scores]
        means = [float(np.mean([s.errors.mean() for s in scores])) for scores in found.values()]
        plain = float(np.mean([s.plain.mean() for s in every]))
        errors = np.concatenate([s.errors for s in every])
        rows.append(
            (
                count,
                round(plain, 2),
                round(float(np.mean(means)), 2),
                f"{100 * (1 - np.mean(means) / plain):.0f} %",
                round(float(np.median(errors)), 2),
                round(float(np.percentile(errors, 95)), 2),
                f"{100 * np.mean([s.held for s in every]):.0f} %",
                round(max(s.fit for s in every), 2),
                round(max(s.frame for s in every), 2),
            )
        )
        reached = sum(mean <= SKINS[name] for name, mean in zip(SKINS, means, strict=True))
        skins.append((count, *(round(mean, 2) for mean in means), f"{reached} of 5"))
    yield Report(
        "places on five hydrogel skins",
        (
            *("presses", "plain process mm", "locator mm", "better by"),
            *("median mm", "p95 mm", "in 90 % ellipse", "learnt in s", "a frame ms"),
        ),
        tuple(rows),
        (
            f"eskin_varsens16, radius 40 mm; presses drawn at random (seeds 0, 1), {TESTED} others "
            "tested, mean error unless said otherwise",
            "plain process: two squared exponentials on arsinh(dv / median |dv|), "
            "marginal likelihood",
        ),
    )
    yield Report(
        "mean error by skin, mm",
        ("presses", *SKINS, "at the published figure"),
        (*skins, ("network, 2000", *SKINS.values(), "–")),
    )


def _two_splits(data: Path) -> Report:
    rows = []
    for name, targets in ROUND.items():
        dv, xy = _arrays(data / "eskin_hydrogel_round" / f"{name}.npz")
        number = np.arange(len(dv))
        splits = {"interleaved": number % 10 == 7, "last tenth": number >= 0.9 * len(dv)}
        for (split, test), target in zip(splits.items(), targets, strict=True):
            score = _of((dv[~test], xy[~test], dv[test], xy[test]))
            rows.append((name, split, *_figures(score), target))
    return Report(
        "a hydrogel skin, two sessions and two patterns",
        (*("file", "tested rows"), *_FIGURES, "promised mm"),
        tuple(rows),
        ("eskin_hydrogel_round, touches within 70 mm; learnt from all other rows of the file",),
    )


def _another_session(data: Path) -> Report:
    """An old calibration with a few presses of today, against those presses alone."""
    folder, rows = data / "eskin_hydrogel_round", []
    names = list(ROUND)[:2]
    for before, today in (names, names[::-1]):
        (old, there), (new, here) = (_arrays(folder / f"{name}.npz") for name in (before, today))
        locator, asked, truth = Locator.fit(old, there), new[200:400], here[200:400]
        for count in (0, 5, 10, 20, 50):
            some, places = new[:count], here[:count]
            both = locator.updated(some, places) if count else locator
            alone = _missed(Locator.fit(some, places), asked, truth) if count > 5 else "–"
            rows.append((before, count, _missed(both, asked, truth), alone))
    return Report(
        "an old calibration in another session, mean error in mm",
        ("calibrated on", "presses of the other session", "added to the old", "alone"),
        tuple(rows),
        ("eskin_hydrogel_round, 16 electrodes; tested on rows 200 to 399 of the other file",),
    )


def _missed(locator: Locator, dv: Floats, xy: Floats) -> float:
    return round(1e3 * float(np.linalg.norm(locator.predict(dv)[0] - xy, axis=1).mean()), 2)


def _drift(data: Path) -> Report:
    dv, xy = _arrays(data / "eskin_hydrogel_rect8" / f"{DRIFTING}.npz")
    rows = []
    for past, target in PASTS.items():
        means = []
        for end in ENDS:
            ahead, before = slice(end, end + AHEAD), slice(end - past, end)
            score = _of((dv[before], xy[before], dv[ahead], xy[ahead]))
            means.append(float(score.errors.mean()))
            rows.append((past, f"{end} to {end + AHEAD - 1}", *_figures(score), target))
        rows.append((past, "mean of all", "", round(float(np.mean(means)), 2), *3 * [""], target))
    return Report(
        "a drifting rectangle: the next 300 presses",
        (*("learnt from the last", "tested"), *_FIGURES, "promised mm"),
        tuple(rows),
        (
            "eskin_hydrogel_rect8, 130 × 60 mm",
            "near row 7920 nine of the 32 channels change at once, some up to a hundredfold: the "
            "last tested stretch is mostly after it, what is learnt from is before",
        ),
    )


_FIGURES = ("plain process mm", "locator mm", "median mm", "p95 mm", "in 90 % ellipse")


def _figures(score: Score) -> tuple[object, ...]:
    return (
        round(float(score.plain.mean()), 2),
        round(float(score.errors.mean()), 2),
        round(float(np.median(score.errors)), 2),
        round(float(np.percentile(score.errors, 95)), 2),
        f"{100 * score.held:.0f} %",
    )


def _of(parts: tuple[Floats, Floats, Floats, Floats]) -> Score:
    dv, xy, tested, truth = parts
    start = time.process_time()
    locator = Locator.fit(dv, xy)
    fit = time.process_time() - start
    told, covariance = locator.predict(tested)
    error = told - truth
    start = time.process_time()
    for frame in tested[:50]:
        locator.predict(frame)
    taken = (time.process_time() - start) / min(len(tested), 50)
    solved = np.linalg.solve(covariance, error[:, :, None])[:, :, 0]
    plain = np.linalg.norm(_plain(dv, xy, tested) - truth, axis=1)
    return Score(
        1e3 * np.linalg.norm(error, axis=1),
        1e3 * plain,
        float(((error * solved).sum(axis=1) < 4.605).mean()),
        fit,
        1e3 * taken,
    )


def _plain(dv: Floats, xy: Floats, tested: Floats) -> Floats:
    """The reference: one process from squashed data to a place."""
    scale = np.median(np.abs(dv))
    learnt, asked = np.arcsinh(dv / scale), np.arcsinh(tested / scale)
    between = squared_distances(learnt, learnt)
    unit, centre, size = np.median(between[between > 0]), xy.mean(axis=0), xy.std()
    terms = (("features",), ("features",))
    process = Process.of(terms, {"features": between / unit}, (xy - centre) / size)
    across = {"features": squared_distances(asked, learnt) / unit}
    return np.asarray(centre + size * process(across))


def _arrays(path: Path) -> tuple[Floats, Floats]:
    """Every channel as it was recorded, reciprocal ones too: they are no copies here."""
    with np.load(path) as kept:
        dv = kept["dv"] if "dv" in kept else kept["v_down"].astype(float) - kept["v_up"]
        return dv.astype(float), 1e-3 * kept["xy_mm"].astype(float)


def _random(path: Path, count: int, seed: int) -> tuple[Floats, Floats, Floats, Floats]:
    dv, xy = _arrays(path)
    order = np.random.default_rng(seed).permutation(len(dv))
    learnt, tested = order[:count], order[-TESTED:]
    return dv[learnt], xy[learnt], dv[tested], xy[tested]
