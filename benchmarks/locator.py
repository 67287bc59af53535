"""Places of touches from labelled presses: the locator against a plain Gaussian process."""

from __future__ import annotations

import time
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from itertools import product
from pathlib import Path
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from bench_rig import INSIDE_90
from report import Floats, Report, percent, recordings, table
from tomoskin import Locator, Pattern, Skin
from tomoskin.extras.alignment import SessionAlignment
from tomoskin.learning import Watch
from tomoskin.learning.touch.gaussian_process import Process, squared_distances

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

BOARDS = (
    (
        *(f"eskin_varsens16/{name}" for name in SKINS),
        "eskin_varsens16_more/cam09_04",
        "eskin_varsens16_more/cam09_05",
        "eskin_hydrogel_round/round16_single550",
        "eskin_hydrogel_round/round16_single500_ohmc",
    ),
    ("eskin_hydrogel_round/round8_single500_ohmc", "eskin_hydrogel_rect8/rect8_single10k"),
    ("eskin_fingertip8/A2", "eskin_membrane8_sixpoint/batch1", "eskin_membrane8_sixpoint/batch2"),
)
"""Sets of one table of rows: a calibration of one is asked about the others."""

FEW, LATE = (25, 100), 150
QUIET = slice(2200, 3700)
"""Presses of rect8 between its jumps."""

Rows = slice | NDArray[np.intp] | NDArray[np.bool_]


@dataclass(frozen=True)
class Score:
    """Of one learning: mm, part inside the 90 % ellipse, seconds of processor to learn, processor
    milliseconds a frame; ``watched`` are the errors where rows are watched.
    """

    errors: Floats
    plain: Floats
    watched: Floats
    held: float
    fit: float
    frame: float

    @property
    def figures(self) -> dict[str, Any]:
        """As tables show them."""
        return {
            "plain process mm": round(float(self.plain.mean()), 2),
            "locator mm": round(float(self.errors.mean()), 2),
            "median mm": round(float(np.median(self.errors)), 2),
            "p95 mm": round(float(np.percentile(self.errors, 95)), 2),
            "in 90 % ellipse": percent(self.held),
        }


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
            dv = _changes(kept)
            pattern = Pattern.from_tables(kept["inj"], kept["meas"])
            return cls(dv, 1e-3 * kept["xy_mm"].astype(float), pattern, skin)

    def at(self, rows: Rows) -> Self:
        """Some of the presses."""
        return replace(self, dv=self.dv[rows], xy=self.xy[rows])

    def learnt(self) -> Locator:
        """A locator of all presses."""
        return Locator.fit(self.dv, self.xy, pattern=self.pattern, skin=self.skin)


def _changes(kept: Mapping[str, Any]) -> Floats:
    """(n, n_meas) by whatever names a set has them."""
    for after, before in (("v_down", "v_up"), ("during", "before"), ("rms_after", "rms_before")):
        if after in kept:
            return np.asarray(kept[after].astype(float) - kept[before])
    return np.asarray(kept["dv"].astype(float))


def run(data: Path | None) -> Iterator[Report]:
    """Learn from the public sets in ``data``, by default those beside the checkout."""
    folder = recordings(data)
    yield from _five_skins(folder / "eskin_varsens16")
    yield table(
        "a hydrogel skin, two sessions and two patterns",
        _two_splits(folder),
        "eskin_hydrogel_round, touches within 70 mm; learnt from all other rows of the file",
    )
    yield table(
        "an old calibration in another session, mean error in mm",
        _another_session(folder / "eskin_hydrogel_round"),
        "eskin_hydrogel_round, 16 electrodes; tested on rows 200 to 399 of the other file",
        across="presses of the other session",
    )
    yield table(
        "other sessions and skins: mean error in mm, and part in the 90 % ellipses",
        _aligned(folder),
        f"{TAUGHT} presses learnt, up to {UNLABELLED} touches without a label (ten with) "
        f"align, {TESTED} or all others tested; drawn at random, seeds {DRAWS}",
        "where an alignment does not hold, the answer is that of the locator as learnt; where "
        "it is not needed, labels are added to its presses; settings were chosen on round16 "
        "and on seeds 100 to 105",
    )
    yield table(
        "a drifting rectangle: the next 300 presses",
        _drift(folder),
        "near row 7920 nine of the 32 channels change at once, some up to a hundredfold: the "
        "last tested stretch is mostly after it, what is learnt from is before",
        "rows watched: frame by frame, without labels; what has jumped is left out (Watch)",
        across="learnt from the last",
    )
    yield table(
        "rows that jump, simulated",
        _jumps(folder),
        f"learnt from the presses before the last {BEFORE + AFTER} (at most 300); then, after "
        f"{BEFORE} presses, a fifth of the rows (drawn, seed {SEEDS[0]}); tested on the last "
        f"{AFTER}",
        across="what jumps",
    )


def run_strangers(data: Path | None) -> Iterator[Report]:
    """A calibration asked about its own later touches, and about other skins."""
    folder = recordings(data, "eskin_varsens16")
    yield table(
        "calibrations on other skins",
        (row for board in BOARDS for row in _strangers({n: folder / f"{n}.npz" for n in board})),
        f"learnt from presses of the first three quarters (drawn, seed {SEEDS[0]}); own: the last "
        f"{LATE}; others: {LATE} of each other set of the same rows",
        "strangeness: medians of a set; the part in the 90 % ellipses is the least of the others",
        across="presses",
    )


def _strangers(files: Mapping[str, Path]) -> Iterator[dict[str, Any]]:
    draw, sets = np.random.default_rng(SEEDS[0]), {}
    for name, file in files.items():
        with np.load(file) as kept:
            dv = _changes(kept)
            xy = 1e-3 * kept["xy_mm"] if "xy_mm" in kept else np.full((len(dv), 2), np.nan)
        part = QUIET if DRIFTING in name else np.isfinite(dv).any(axis=1)
        sets[name] = dv[part], xy[part]
    for name, count in product(sets, FEW):
        dv, xy = sets[name]
        if np.isnan(xy).all():
            continue
        rows = np.sort(draw.permutation(len(dv) * 3 // 4)[:count])
        locator = Locator.fit(dv[rows], xy[rows])
        scores = {}
        for other, (theirs, there) in sets.items():
            late = other == name
            some = slice(-LATE, None) if late else draw.permutation(len(theirs))[:LATE]
            strange = float(np.median(locator.strangeness(theirs[some])))
            scores[other] = strange, part_held(locator, theirs[some], there[some])
        own = scores.pop(name)
        nearest = min(scores, key=lambda other: scores[other][0])
        known = [held for _, held in scores.values() if np.isfinite(held)]
        yield {
            "learnt on": Path(name).name,
            "presses": count,
            "own": round(own[0], 2),
            "in 90 % ellipse": percent(own[1]),
            "others, least": round(scores[nearest][0], 2),
            "which": Path(nearest).name,
            "others in 90 % ellipse": percent(min(known)) if known else "–",
        }


def disc(**electrodes: str) -> Skin:
    """The five skins' outline, and where their electrodes are, as far as that is given."""
    return Skin.load("textile-disc-16").altered(
        {"outline": {"diameter": DIAMETER}, "electrodes": {"width": "3 mm"} | electrodes}
    )


def _five_skins(folder: Path) -> Iterator[Report]:
    skin = disc()
    sets = {name: Set.of(folder / f"{name}.npz", skin) for name in SKINS}
    rows, skins = [], []
    for count, repeats in COUNTS.items():
        scores = {
            name: [_of(*_random(known, count, seed)) for seed in SEEDS[:repeats]]
            for name, known in sets.items()
        }
        every = [score for some in scores.values() for score in some]
        means = {name: np.mean([s.errors.mean() for s in some]) for name, some in scores.items()}
        plain, ours = np.mean([s.plain.mean() for s in every]), np.mean(list(means.values()))
        errors = np.concatenate([s.errors for s in every])
        rows.append(
            {
                "presses": count,
                "plain process mm": round(float(plain), 2),
                "locator mm": round(float(ours), 2),
                "better by": percent(1 - ours / plain),
                "median mm": round(float(np.median(errors)), 2),
                "p95 mm": round(float(np.percentile(errors, 95)), 2),
                "in 90 % ellipse": percent([s.held for s in every]),
                "learnt in s": round(max(s.fit for s in every), 2),
                "a frame ms": round(max(s.frame for s in every), 2),
            }
        )
        reached = sum(mean <= SKINS[name] for name, mean in means.items())
        rounded = {name: round(float(mean), 2) for name, mean in means.items()}
        skins.append({"presses": count} | rounded | {"at the published figure": f"{reached} of 5"})
    yield table(
        "places on five hydrogel skins",
        rows,
        f"eskin_varsens16, radius 40 mm; presses drawn at random (seed {SEEDS[0]}, to 200 also "
        f"{SEEDS[1]}), {TESTED} others tested, mean error unless said otherwise",
        "known: the table of rows, and the disc's size; learnt in s: the slowest, by the processor",
        "plain process: two squared exponentials on arsinh(dv / median |dv|), marginal likelihood",
    )
    yield table("mean error by skin, mm", [*skins, {"presses": "network, 2000", **SKINS}])


def _two_splits(data: Path) -> Iterator[dict[str, Any]]:
    for name, targets in ROUND.items():
        known = Set.of(data / "eskin_hydrogel_round" / f"{name}.npz")
        number = np.arange(len(known.dv))
        splits = {"interleaved": number % 10 == 7, "last tenth": number >= 0.9 * len(number)}
        for (split, test), target in zip(splits.items(), targets, strict=True):
            score = _of(known.at(~test), known.at(test))
            yield {"file": name, "tested rows": split} | score.figures | {"promised mm": target}


def _another_session(folder: Path) -> Iterator[dict[str, Any]]:
    """An old calibration with a few presses of today, against those presses alone."""
    names = list(ROUND)[:2]
    for before, today in (names, names[::-1]):
        old, new = (Set.of(folder / f"{name}.npz") for name in (before, today))
        locator, asked = old.learnt(), new.at(slice(200, 400))
        for count in (0, 5, 10, 20, 50):
            some = new.at(slice(count))
            both = locator.updated(some.dv, some.xy) if count else locator
            yield {
                "calibrated on": before,
                "presses of the other session": count,
                "added to the old": mean_error(both, asked),
                "alone": mean_error(some.learnt(), asked) if count > 5 else "–",
            }


def _aligned(data: Path) -> Iterator[dict[str, Any]]:
    """A calibration on other sessions and skins: as learnt, aligned without labels and with ten."""
    ways = ("as learnt", "aligned, no labels", "with ten")
    for (before, today), skin in (*((pair, None) for pair in PAIRS), (OUTLINE, disc())):
        old, new = (Set.of(data / f"{name}.npz", skin) for name in (before, today))
        scores = np.array([_transferred(old, new, seed) for seed in DRAWS])
        means = scores[:, 1:].mean(axis=0).reshape(-1, 2)
        pairs = [f"{error:.1f}, {held:.0%}" for error, held in means]
        yield {
            "learnt on": Path(before).name + (", outline known" if skin else ""),
            "asked on": Path(today).name,
            **dict(zip(ways, pairs, strict=True)),
            "held to hold": f"{scores[:, 0].sum():.0f} of {len(DRAWS)}",
        }


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
        known.append(alignment.locator(locator) if alignment.holds else locator)
    scores = [(mean_error(one, asked), held(one, asked)) for one in known]
    return (float(none.holds), *(figure for score in scores for figure in score))


def held(locator: Locator, asked: Set) -> float:
    """Part of the presses in their 90 % ellipses."""
    return part_held(locator, asked.dv, asked.xy)


def part_held(locator: Locator, dv: Floats, xy: Floats) -> float:
    """Part of presses ``dv`` (n, n_meas) at ``xy`` (n, 2) m that their 90 % ellipses hold; NaN
    where it is not known where they are."""
    told, covariance = locator.predict(dv)
    error = told - xy
    solved = np.linalg.solve(covariance, error[:, :, None])[:, :, 0]
    inside = np.where(np.isnan(xy).any(axis=1), np.nan, (error * solved).sum(axis=1) < INSIDE_90)
    return float(inside.mean())


def mean_error(locator: Locator, asked: Set) -> float:
    """Of all presses, mm."""
    return round(float(_missed(locator.predict(asked.dv)[0], asked).mean()), 2)


def _missed(told: Floats, asked: Set) -> Floats:
    """(n,) mm."""
    return np.asarray(1e3 * np.linalg.norm(told - asked.xy, axis=1))


def _drift(data: Path) -> Iterator[dict[str, Any]]:
    known = Set.of(data / "eskin_hydrogel_rect8" / f"{DRIFTING}.npz")
    for past, target in PASTS.items():
        scores = []
        for end in ENDS:
            score = _of(known.at(slice(end - past, end)), known.at(slice(end, end + AHEAD)))
            case = {"tested": f"{end} to {end + AHEAD - 1}", "learnt from the last": past}
            watched = {"rows watched mm": round(float(score.watched.mean()), 2)}
            yield case | score.figures | watched | {"promised mm": target}
            scores.append(score)
        yield {
            "tested": "mean of all",
            "learnt from the last": past,
            "locator mm": round(float(np.mean([s.errors.mean() for s in scores])), 2),
            "rows watched mm": round(float(np.mean([s.watched.mean() for s in scores])), 2),
            "promised mm": target,
        }


def _jumps(data: Path) -> Iterator[dict[str, Any]]:
    paths = [data / "eskin_hydrogel_round" / f"{name}.npz" for name in ROUND]
    for path in (*paths, data / "eskin_varsens16" / "radial.npz"):
        whole = Set.of(path).at(slice(450))
        known, asked = whole.at(slice(-BEFORE - AFTER)), whole.at(slice(-BEFORE - AFTER, None))
        locator, rng = known.learnt(), np.random.default_rng(SEEDS[0])
        some = rng.permutation(asked.dv.shape[1])[: round(JUMPED * asked.dv.shape[1])]
        for what, factor in {"nothing": 1.0, **JUMPS}.items():
            dv = asked.dv.copy()
            dv[BEFORE:, some] *= factor
            after, watch = asked.at(slice(BEFORE, None)), Watch(locator)
            told = watch(dv)[0][BEFORE:], locator.predict(dv[BEFORE:])[0]
            watched, plain = (round(float(_missed(t, after).mean()), 2) for t in told)
            jumped = set(watch.jumped.tolist())
            right = len(jumped & set(some.tolist())) if factor != 1 else 0
            yield {
                "file": path.stem,
                "what jumps": what,
                "locator mm": plain,
                "rows watched mm": watched,
                "rows found": right,
                "wrongly": len(jumped) - right,
            }


def _of(known: Set, asked: Set) -> Score:
    start = time.process_time()
    locator = known.learnt()
    fit = time.process_time() - start
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
