"""A sheet that deforms and was never taught, judged by a plant that shares nothing with the fit."""

from __future__ import annotations

import math
import time
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from bench_rig import INSIDE_90, distance, drawn, matched, stage
from deform_course import AFTER, HELD, RAMP, Bench, Run
from deform_plant import PROFILES, Ball, Fold, Pose, Stretch, Wrap
from report import Report, progress, table
from tomoskin.core import Detection
from tomoskin.pipeline import FrameResult, Pipeline
from touch_lab import APART

SEEDS, QUICK_SEED, ELECTRODES, LAWS = (62011, 62012), 61001, (8, 16), ("affine", "percolating")
"""Nothing was chosen on SEEDS; the quick one is there to choose on."""

DRAWS = {"fold": 8, "stretch": 3, "biaxial stretch": 2, "cylinder": 3}
FLAT, OTHERS = 8, 4
"""Poses of each kind, seed, law and skin; flat sheets with each number of presses; other cases."""

ANGLES, OFFSETS, WIDTHS, STRAINS, RADII = (8, 35), 0.06, (0.03, 0.08), (0.01, 0.05), (0.06, 0.24)
FORCES, FLAT_FORCES, FALLS, REACH = (4.0, 8.0), (1.0, 8.0), (0.4, 0.55), 0.08
"""Degrees; m; m; parts; m. N; part of the conductance at 4 N; m from the middle."""

RIGHT = {
    "fold": {"fold"},
    "stretch": {"stretch", "cylinder"},
    "biaxial stretch": {"stretch", "common"},
    "cylinder": {"cylinder", "stretch"},
    "gain step": {"common"},
}
"""Kinds that are right: an even stretch and a cylinder under all of the sheet are one strain, a
stretch that is the same in all directions and a gain are one change."""

UNTOUCHED = "bending", "held", "straightening", "after"


class Shown(NamedTuple):
    """One frame: of which run and part, what the live pipeline made of it, and its ms."""

    run: Run
    part: str
    result: FrameResult
    ms: float


def run() -> Iterator[Report]:
    yield from _reports(DRAWS, FLAT, OTHERS, SEEDS)


def run_quick() -> Iterator[Report]:
    """A tenth of it, on another seed: to choose on."""
    yield from _reports(dict.fromkeys(DRAWS, 1) | {"fold": 2}, 1, 1, (QUICK_SEED,))


def _reports(
    draws: Mapping[str, int], flat: int, others: int, seeds: Sequence[int]
) -> Iterator[Report]:
    bent = [shown for run in _bent(draws, seeds) for shown in followed(run)]
    notes = (
        f"{sum(draws.values()) * len(LAWS) * len(seeds)} sheets of each skin, seeds {seeds}; folds "
        f"of {ANGLES[0]} to {ANGLES[1]}° over {1e3 * WIDTHS[0]:.0f} to {1e3 * WIDTHS[1]:.0f} mm, "
        f"{', '.join(PROFILES)}, a third of them hollow; stretches of {100 * STRAINS[0]:.0f} to "
        f"{100 * STRAINS[1]:.0f} %; cylinders of {1e3 * RADII[0]:.0f} to {1e3 * RADII[1]:.0f} mm",
        f"bent in {RAMP[0]:g} to {RAMP[1]:g} s, held for {HELD:g} s, pressed, straightened, "
        f"{AFTER:g} s after; on a third electrodes stay while the sheet slides",
        "affine: dimensions alone, gauge 2; percolating: gauge 3 to 8",
    )
    yield table("nobody presses: frames with a touch", _grouped(bent, _untouched), *notes)
    yield table("nobody presses, held: what is told", _grouped(bent, _told))
    yield table("one press of 4 to 8 N on it", _grouped(bent, _pressed))
    flats = [shown for run in _flat(flat, seeds) for shown in followed(run)]
    newtons = f"presses of {FLAT_FORCES[0]:g} to {FLAT_FORCES[1]:g} N"
    yield table("flat sheets", _grouped(flats, _pressed), newtons)
    odd = [shown for run in _others(others, seeds) for shown in followed(run)]
    yield table("what no kind fits, and a gain", _grouped(odd, _other))
    yield table("ms of processor time a frame, median", _grouped(bent, _cost, whole=True))


def followed(run: Run) -> list[Shown]:
    """Frames of a run from its reference on, as the live pipeline shows them."""
    progress(f"{run}")
    bench, out = Bench(run), []
    pipeline = Pipeline(bench.prepared)
    for part, frame in bench.frames():
        begun = time.process_time()
        result = pipeline.push(frame)
        spent = 1e3 * (time.process_time() - begun)
        if part and result is not None and result.ready:
            out.append(Shown(run, part, result, spent))
    return out


def _bent(draws: Mapping[str, int], seeds: Sequence[int]) -> Iterator[Run]:
    cases = [(e, law, kind) for e in ELECTRODES for kind in draws for law in LAWS]
    for electrodes, law, kind in cases:
        for seed in (1000 * s + n for s in seeds for n in range(draws[kind])):
            random = np.random.default_rng([seed, electrodes, *kind.encode(), *law.encode()])
            pose, balls, chance = _pose(kind, random), _balls(random, 1), random.uniform(size=2)
            early, slides = bool(chance[0] < 0.25), bool(chance[1] < 1 / 3)
            yield Run(kind, electrodes, law, seed, (pose,), balls, early, slides=slides)


def _flat(count: int, seeds: Sequence[int]) -> Iterator[Run]:
    for electrodes, presses in ((e, p) for e in ELECTRODES for p in (1, 2, 3)):
        for seed in (1000 * s + 500 + n for s in seeds for n in range(count)):
            random = np.random.default_rng([seed, electrodes, presses])
            balls = _balls(random, presses, FLAT_FORCES)
            yield Run(f"{presses}", electrodes, "–", seed, balls=balls)


def _others(count: int, seeds: Sequence[int]) -> Iterator[Run]:
    for electrodes in ELECTRODES:
        for seed in (1000 * s + 700 + n for s in seeds for n in range(count)):
            random = np.random.default_rng([seed, electrodes])
            fold, gain = _fold(random), random.choice([-1, 1]) * random.uniform(0.03, 0.15)
            basis, turn = Run("", electrodes, LAWS[1], seed), float(random.uniform(0.6, 2.5))
            yield replace(basis, kind="gain step", gain=float(gain))
            two = fold, replace(fold, axis=fold.axis + turn, offset=OFFSETS / 2)
            yield replace(basis, kind="two folds", poses=two)
            far = replace(fold, angle=math.radians(120)) if seed % 2 else Stretch(0.2, -0.08, turn)
            yield replace(basis, kind="far too much", poses=(far,))
            e = int(random.integers(electrodes))
            through = _through(fold, e, electrodes)
            yield replace(basis, kind="through an electrode", poses=(through,), loosened=e)


def _fold(random: np.random.Generator) -> Fold:
    """A third of them hollow."""
    angle = float(random.choice([1, 1, -1]) * np.radians(random.uniform(*ANGLES)))
    axis, offset = random.uniform(0, np.pi), random.uniform(-OFFSETS, OFFSETS)
    width, shrunk = random.uniform(*WIDTHS), random.uniform(0, 0.25)
    profile = str(random.choice(list(PROFILES)))
    return Fold(angle, float(axis), float(offset), float(width), profile, float(shrunk))


def _through(fold: Fold, electrode: int, electrodes: int) -> Fold:
    """The same fold, narrow, through the middle of an electrode."""
    x, y = stage(electrodes).skin.electrode_centres[electrode].tolist()
    return replace(fold, offset=x * math.sin(fold.axis) - y * math.cos(fold.axis), width=0.02)


def _pose(kind: str, random: np.random.Generator) -> Pose:
    if kind == "fold":
        return _fold(random)
    axis = float(random.uniform(0, np.pi))
    if kind == "cylinder":
        turns = random.choice([1, 1, -1]) * random.uniform(1 / RADII[1], 1 / RADII[0])
        return Wrap(1 / float(turns), axis, 0.24)
    along, poisson, part = random.uniform((STRAINS[0], 0.3, 0.3), (STRAINS[1], 0.5, 1.0)).tolist()
    return Stretch(along, along * (part if kind == "biaxial stretch" else -poisson), axis)


def _balls(
    random: np.random.Generator, count: int, forces: tuple[float, float] = FORCES
) -> tuple[Ball, ...]:
    places = drawn(random, count, reach=REACH, forces=forces)
    return tuple(Ball(p.x, p.y, p.force, float(random.uniform(*FALLS))) for p in places)


def _grouped(
    every: Sequence[Shown],
    row: Callable[[Sequence[Shown]], dict[str, Any]],
    *,
    whole: bool = False,
) -> Iterator[dict[str, Any]]:
    """A row of each kind, skin and law, and one of each skin."""
    skins = dict.fromkeys(one.run.electrodes for one in every)
    keys = dict.fromkeys((one.run.kind, one.run.electrodes, one.run.law) for one in every)
    names = "kind", "electrodes", "law"
    for kind, electrodes, law in () if whole else keys:
        asked = kind, electrodes, law
        some = [s for s in every if (s.run.kind, s.run.electrodes, s.run.law) == asked]
        yield dict(zip(names, asked, strict=True)) | row(some)
    for electrodes in skins:
        some = [one for one in every if one.run.electrodes == electrodes]
        yield dict(zip(names, ("all", electrodes, "all"), strict=True)) | row(some)


def _of(some: Sequence[Shown], *parts: str) -> list[Shown]:
    return [one for one in some if one.part in parts]


def _part(truths: Sequence[bool]) -> str:
    """In per cent; a dash where there are none."""
    return f"{100 * float(np.mean(truths)):.1f} %" if len(truths) else "–"


def _middle(values: Sequence[float]) -> float | str:
    return round(float(np.median(values)), 1) if len(values) else "–"


def _untouched(some: Sequence[Shown]) -> dict[str, Any]:
    def touched(*parts: str) -> str:
        return _part([bool(one.result.touches) for one in _of(some, *parts)])

    named = {part: touched(part) for part in UNTOUCHED} | {"after a press": touched("lifted")}
    return {"frames": len(_of(some, *UNTOUCHED)), "all": touched(*UNTOUCHED)} | named


def _told(some: Sequence[Shown]) -> dict[str, Any]:
    held = [(one.run, deformation_of(one.result)) for one in _of(some, "held")]
    right = [(run, d) for run, d in held if d is not None and d.kind in RIGHT[run.kind]]
    return {
        "frames": len(held),
        "kind right": _part([d is not None and d.kind in RIGHT[r.kind] for r, d in held]),
        "n": len(right),
    }


def deformation_of(result: FrameResult) -> Any:
    """What a frame says of a deformation; None where it says nothing."""
    return getattr(result, "deformation", None)


def _pressed(some: Sequence[Shown]) -> dict[str, Any]:
    """Presses found within half of the least distance of two; errors of touches wherever."""
    found, extra, ghosts, far, near = [], [], [], [], []
    for run, _, result, _ in _of(some, "pressed"):
        touches = [touch.detection for touch in result.touches]
        pairs = _pairs(run.balls, touches)
        within = [(run.balls[b], touches[t]) for b, t, error in pairs if error < APART / 2]
        far += [error for *_, error in pairs]
        near += [distance(touch, ball.x, ball.y) < INSIDE_90 for ball, touch in within]
        found.append(len(within) == len(run.balls))
        extra.append(len(touches) > len(run.balls))
        ghosts.append(len(touches) > len(within))
    return {
        "frames": len(found),
        "all found": _part(found),
        "error, mm, median": _middle([1e3 * error for error in far]),
        "in 90 % ellipse": _part(near),
        "more touches than presses": _part(extra),
        "ghosts": _part(ghosts),
        "none while bending": _part([not s.result.touches for s in _of(some, "bending pressed")]),
        "deformation told": _part(
            [deformation_of(s.result) is not None for s in _of(some, "pressed")]
        ),
    }


def _pairs(balls: Sequence[Ball], touches: Sequence[Detection]) -> list[tuple[int, int, float]]:
    if not touches or not balls:
        return []
    return matched(*(np.array([(one.x, one.y) for one in each]) for each in (balls, touches)))


def _other(some: Sequence[Shown]) -> dict[str, Any]:
    told = [deformation_of(one.result) for one in _of(some, "held")]
    kinds = Counter("nothing" if one is None else one.kind for one in told)
    words = [one.result.unexplained is not None for one in _of(some, "held")]
    named = "; ".join(f"{kind} {100 * n / len(told):.0f} %" for kind, n in kinds.most_common())
    return _untouched(some) | {"told": named, "unexplained": _part(words)}


def _cost(some: Sequence[Shown]) -> dict[str, Any]:
    parts = "rest", "bending", "held", "pressed", "after"
    return {p: round(float(np.median([one.ms for one in _of(some, p)])), 3) for p in parts}
