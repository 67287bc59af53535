"""Places of touches from labelled presses: the locator against a plain Gaussian process."""

from __future__ import annotations

import time
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Self

import numpy as np
from numpy.typing import NDArray

from report import Report
from tomoskin import Locator, Pattern, Skin
from tomoskin.core import DataError
from tomoskin.learning import SessionAlignment, Watch
from tomoskin.learning.touch.process import Process, squared_distances

SHARED = Path(__file__).parents[2] / "shared" / "data"

SKINS = {"noPattern": 2.28, "fullCB": 6.74, "parallel": 3.13, "concentric": 4.99, "radial": 3.84}
"""Five skins with what their authors' network reaches after 2,000 presses, mm."""

COUNTS = {25: 2, 50: 2, 100: 2, 200: 2, 500: 1, 1000: 1, 1800: 1}
"""Presses learnt from, and with how many of the seeds."""

SEEDS = (31, 32)
DIAMETER = "80 mm"

TESTED = 225
ROUND = {
    "round16_single550": (2.5, 5.5),
    "round16_single500_ohmc": (3.0, 3.8),
    "round8_single500_ohmc": (2.6, 2.6),
}
DRIFTING, AHEAD = "rect8_single10k", 300
ENDS = (1700, 3300, 4900, 6500, 7300, 7800)
PASTS = {1500: 10.5, 300: 14.0}
JUMPS = {"30 times as large": 30.0, "sign turned": -1.0}
JUMPED, BEFORE, AFTER = 0.2, 50, 100
"""Part of the rows that jump, and tested presses before and after they do."""

TAUGHT, UNLABELLED, DRAWS = 500, 500, (41, 42, 43)
OUTLINE = ("eskin_varsens16_more/cam09_04", "eskin_varsens16/fullCB")
PAIRS = (
    ("eskin_hydrogel_round/round16_single550", "eskin_hydrogel_round/round16_single500_ohmc"),
    ("eskin_hydrogel_round/round16_single500_ohmc", "eskin_hydrogel_round/round16_single550"),
    ("eskin_varsens16_more/cam09_04", "eskin_varsens16/fullCB"),
    ("eskin_varsens16/fullCB", "eskin_varsens16_more/cam09_04"),
    ("eskin_varsens16_more/cam09_05", "eskin_varsens16/noPattern"),
    ("eskin_varsens16/noPattern", "eskin_varsens16_more/cam09_05"),
    ("eskin_varsens16/noPattern", "eskin_varsens16/fullCB"),
    ("eskin_varsens16/radial", "eskin_varsens16/parallel"),
)

Floats = NDArray[np.float64]
Rows = slice | NDArray[np.intp] | NDArray[np.bool_]


@dataclass(frozen=True)
class Score:
    """Of one learning: mm, part inside the 90 % ellipse, seconds of processor and clock to learn,
    processor milliseconds a frame; ``watched`` are the errors where rows are watched.
    """

    errors: Floats
    plain: Floats
    watched: Floats
    held: float
    fit: tuple[float, float]
    frame: float


@dataclass(frozen=True)
class Set:
    """A recording: changes (n, n_meas), places (n, 2) m, and what is known of the skin."""

    dv: Floats
    xy: Floats
    pattern: Pattern
    skin: Skin | None = None

    @classmethod
    def of(cls, path: Path, skin: Skin | None = None) -> Self:
        """Every channel as it was recorded, reciprocal ones too: they are no copies here."""
        with np.load(path) as kept:
            dv = kept["dv"] if "dv" in kept else kept["v_down"].astype(float) - kept["v_up"]
            pattern = Pattern.from_tables(kept["inj"], kept["meas"])
            return cls(dv.astype(float), 1e-3 * kept["xy_mm"].astype(float), pattern, skin)

    def at(self, rows: Rows) -> Self:
        """Some of the presses."""
        return replace(self, dv=self.dv[rows], xy=self.xy[rows])

    def learnt(self) -> Locator:
        """A locator of all presses."""
        return Locator.fit(self.dv, self.xy, pattern=self.pattern, skin=self.skin)


def run(data: Path | None) -> tuple[Report, ...]:
    """Learn from the public sets in ``data``, by default those beside the checkout."""
    data = data or SHARED
    if not data.is_dir():
        raise DataError("expected the public recordings", where=str(data), hint="--data FOLDER")
    return (
        *_five_skins(data / "eskin_varsens16"),
        _two_splits(data),
        _another_session(data),
        _aligned(data),
        _drift(data),
        _jumps(data),
    )


def _disc() -> Skin:
    return Skin.load("textile-disc-16").altered(
        {"outline": {"diameter": DIAMETER}, "electrodes": {"width": "3 mm"}}
    )


def _five_skins(folder: Path) -> Iterator[Report]:
    disc = _disc()
    sets = {name: Set.of(folder / f"{name}.npz", disc) for name in SKINS}
    rows, skins = [], []
    for count, repeats in COUNTS.items():
        found = {
            name: [_of(*_random(known, count, seed)) for seed in SEEDS[:repeats]]
            for name, known in sets.items()
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
                *(round(max(s.fit[k] for s in every), 2) for k in (0, 1)),
                round(max(s.frame for s in every), 2),
            )
        )
        reached = sum(mean <= SKINS[name] for name, mean in zip(SKINS, means, strict=True))
        skins.append((count, *(round(mean, 2) for mean in means), f"{reached} of 5"))
    yield Report(
        "places on five hydrogel skins",
        (
            *("presses", "plain process mm", "locator mm", "better by"),
            *(
                "median mm",
                "p95 mm",
                "in 90 % ellipse",
                "learnt in s",
                "by the clock",
                "a frame ms",
            ),
        ),
        tuple(rows),
        (
            f"eskin_varsens16, radius 40 mm; presses drawn at random (seed {SEEDS[0]}, to 200 also "
            f"{SEEDS[1]}), {TESTED} others tested, mean error unless said otherwise",
            "known beside the presses: the table of rows, and that the skin is a disc of that "
            "size; where its electrodes are and which way round they go is not",
            "learnt in s: the slowest, by the processor",
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
        known = Set.of(data / "eskin_hydrogel_round" / f"{name}.npz")
        number = np.arange(len(known.dv))
        splits = {"interleaved": number % 10 == 7, "last tenth": number >= 0.9 * len(number)}
        for (split, test), target in zip(splits.items(), targets, strict=True):
            score = _of(known.at(~test), known.at(test))
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
        old, new = (Set.of(folder / f"{name}.npz") for name in (before, today))
        locator, asked = old.learnt(), new.at(slice(200, 400))
        for count in (0, 5, 10, 20, 50):
            some = new.at(slice(count))
            both = locator.updated(some.dv, some.xy) if count else locator
            alone = mean_error(some.learnt(), asked) if count > 5 else "–"
            rows.append((before, count, mean_error(both, asked), alone))
    return Report(
        "an old calibration in another session, mean error in mm",
        ("calibrated on", "presses of the other session", "added to the old", "alone"),
        tuple(rows),
        ("eskin_hydrogel_round, 16 electrodes; tested on rows 200 to 399 of the other file",),
    )


def _aligned(data: Path) -> Report:
    """A calibration on other sessions and skins: as learnt, aligned without labels and with ten."""
    rows = []
    for (before, today), skin in (*((pair, None) for pair in PAIRS), (OUTLINE, _disc())):
        old, new = (Set.of(data / f"{name}.npz", skin) for name in (before, today))
        scores = [_transferred(old, new, seed) for seed in DRAWS]
        holds = sum(score[0] for score in scores)
        figures = np.mean([score[1:] for score in scores], axis=0)
        errors, held = figures[::2], figures[1::2]
        pairs = [f"{e:.1f}, {h:.0%}" for e, h in zip(errors, held, strict=True)]
        name = Path(before).name + (", outline known" if skin else "")
        rows.append((name, Path(today).name, *pairs, f"{holds} of {len(DRAWS)}"))
    return Report(
        "other sessions and skins: mean error in mm, and part in the 90 % ellipses",
        ("learnt on", "asked on", "as learnt", "aligned, no labels", "with ten", "held to hold"),
        tuple(rows),
        (
            f"{TAUGHT} presses learnt, up to {UNLABELLED} touches without a label (ten with) "
            f"align, {TESTED} or all others tested; drawn at random, seeds {DRAWS}",
            "where an alignment does not hold, the answer is that of the locator as learnt; where "
            "it is not needed, labels are added to its presses; settings were chosen on round16 "
            "and on seeds 100 to 105",
        ),
    )


def _transferred(old: Set, new: Set, seed: int) -> tuple[float, ...]:
    rng = np.random.default_rng(seed)
    locator = old.at(rng.permutation(len(old.dv))[:TAUGHT]).learnt()
    order = rng.permutation(len(new.dv))
    here = min(UNLABELLED, len(order) - 100)
    touched, asked = new.at(order[:here]), new.at(order[here:][-TESTED:])
    labels = np.full(touched.xy.shape, np.nan)
    labels[:10] = touched.xy[:10]
    none, ten = (SessionAlignment.of(locator, touched.dv, xy) for xy in (None, labels))
    known = [locator]
    for alignment in (none, ten):
        known.append(locator.aligned(alignment) if alignment.holds else locator)
    scores = [(mean_error(one, asked), held(one, asked)) for one in known]
    return (float(none.holds), *(figure for score in scores for figure in score))


def held(locator: Locator, asked: Set) -> float:
    told, covariance = locator.predict(asked.dv)
    error = told - asked.xy
    solved = np.linalg.solve(covariance, error[:, :, None])[:, :, 0]
    return float(((error * solved).sum(axis=1) < 4.605).mean())


def mean_error(locator: Locator, asked: Set) -> float:
    return round(float(_missed(locator.predict(asked.dv)[0], asked).mean()), 2)


def _missed(told: Floats, asked: Set) -> Floats:
    """(n,) mm."""
    return np.asarray(1e3 * np.linalg.norm(told - asked.xy, axis=1))


def _drift(data: Path) -> Report:
    known = Set.of(data / "eskin_hydrogel_rect8" / f"{DRIFTING}.npz")
    rows = []
    for past, target in PASTS.items():
        scores = []
        for end in ENDS:
            score = _of(known.at(slice(end - past, end)), known.at(slice(end, end + AHEAD)))
            watched = round(float(score.watched.mean()), 2)
            rows.append((past, f"{end} to {end + AHEAD - 1}", *_figures(score), watched, target))
            scores.append(score)
        mean, watched = (
            round(float(np.mean([part(score).mean() for score in scores])), 2)
            for part in (lambda s: s.errors, lambda s: s.watched)
        )
        rows.append((past, "mean of all", "", mean, *3 * [""], watched, target))
    return Report(
        "a drifting rectangle: the next 300 presses",
        (*("learnt from the last", "tested"), *_FIGURES, "rows watched mm", "promised mm"),
        tuple(rows),
        (
            "eskin_hydrogel_rect8, 130 × 60 mm",
            "near row 7920 nine of the 32 channels change at once, some up to a hundredfold: the "
            "last tested stretch is mostly after it, what is learnt from is before",
            "rows watched: frame by frame, without labels; what has jumped is left out (Watch)",
        ),
    )


def _jumps(data: Path) -> Report:
    rows = []
    paths = [data / "eskin_hydrogel_round" / f"{name}.npz" for name in ROUND]
    for path in (*paths, data / "eskin_varsens16" / "radial.npz"):
        whole = Set.of(path).at(slice(450))
        known, asked = whole.at(slice(-BEFORE - AFTER)), whole.at(slice(-BEFORE - AFTER, None))
        locator = known.learnt()
        rng = np.random.default_rng(SEEDS[0])
        some = rng.permutation(asked.dv.shape[1])[: round(JUMPED * asked.dv.shape[1])]
        for what, factor in {"nothing": 1.0, **JUMPS}.items():
            dv = asked.dv.copy()
            dv[BEFORE:, some] *= factor
            after, watch = asked.at(slice(BEFORE, None)), Watch(locator)
            told = watch(dv)[0][BEFORE:], locator.predict(dv[BEFORE:])[0]
            watched, plain = (round(float(_missed(t, after).mean()), 2) for t in told)
            jumped = set(watch.jumped.tolist())
            right = len(jumped & set(some.tolist())) if factor != 1 else 0
            rows.append((path.stem, what, plain, watched, right, len(jumped) - right))
    return Report(
        "rows that jump, simulated",
        (*("file", "what jumps", "locator mm", "rows watched mm"), *("rows found", "wrongly")),
        tuple(rows),
        (
            f"learnt from the presses before the last {BEFORE + AFTER} (at most 300); then, after "
            f"{BEFORE} presses, a fifth of the rows (drawn, seed {SEEDS[0]}); tested on the last "
            f"{AFTER}",
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


def _of(known: Set, asked: Set) -> Score:
    start = time.process_time(), time.perf_counter()
    locator = known.learnt()
    fit = time.process_time() - start[0], time.perf_counter() - start[1]
    told, _ = locator.predict(asked.dv)
    begun = time.process_time()
    for frame in asked.dv[:50]:
        locator.predict(frame)
    taken = (time.process_time() - begun) / min(len(asked.dv), 50)
    return Score(
        _missed(told, asked),
        _missed(plain(known.dv, known.xy, asked.dv), asked),
        _missed(Watch(locator)(asked.dv)[0], asked),
        held(locator, asked),
        fit,
        1e3 * taken,
    )


def plain(dv: Floats, xy: Floats, tested: Floats) -> Floats:
    """The reference: one process from squashed data to a place."""
    scale = np.median(np.abs(dv))
    learnt, asked = np.arcsinh(dv / scale), np.arcsinh(tested / scale)
    between = squared_distances(learnt, learnt)
    unit, centre, size = np.median(between[between > 0]), xy.mean(axis=0), xy.std()
    terms = (("features",), ("features",))
    process = Process.of(terms, {"features": between / unit}, (xy - centre) / size)
    across = {"features": squared_distances(asked, learnt) / unit}
    return np.asarray(centre + size * process(across))


def _random(whole: Set, count: int, seed: int) -> tuple[Set, Set]:
    order = np.random.default_rng(seed).permutation(len(whole.dv))
    return whole.at(order[:count]), whole.at(order[-TESTED:])
