"""A sheet that deforms and was never taught, judged by a plant that shares nothing with the fit."""

from __future__ import annotations

import math
import time
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from bench_rig import INSIDE_90, distance, drawn, gap, matched, stage
from deform_course import AFTER, HELD, RAMP, Bench, Run
from deform_plant import PROFILES, RADIUS, Ball, Fold, Pose, Stretch, Wrap
from report import Report, progress, table
from tomoskin.core import Detection, Touch
from tomoskin.pipeline import Pipeline
from tomoskin.sensing.fit import Deformation
from touch_lab import APART

SEEDS, QUICK_SEED, ELECTRODES, LAWS = (62011, 62012), 61001, (8, 16), ("affine", "percolating")
"""Nothing was chosen on SEEDS; the quick one is there to choose on."""

DRAWS = {"fold": 6, "fold, sliding": 2, "stretch": 3, "biaxial stretch": 2, "cylinder": 3}
FLAT, OTHERS = 8, 4
"""Poses of each kind, seed, law and skin; flat sheets with each number of presses; other cases."""

ANGLES, OFFSETS, WIDTHS, STRAINS, RADII = (8, 35), 0.06, (0.03, 0.08), (0.01, 0.05), (0.06, 0.24)
FORCES, FLAT_FORCES, FALLS, REACH = (4.0, 8.0), (1.0, 8.0), (0.4, 0.55), 0.08
"""Degrees; m; m; parts; m. N; part of the conductance at 4 N; m from the middle."""

RIGHT = {
    "fold": {"fold"},
    "fold, sliding": {"fold"},
    "stretch": {"stretch"},
    "biaxial stretch": {"stretch", "common"},
    "cylinder": {"stretch"},
}
"""Kinds that are right. A cylinder under all of the sheet strains it evenly; of a stretch that is
the same in all directions voltages change as of a gain."""

LEAST = 3e-3
"""Of a strain or a change that has a relative error."""

UNTOUCHED = "bending", "held", "straightening", "after"


class Shown(NamedTuple):
    """One frame: of which run and part, how much of the pose the sheet follows by then (it creeps),
    what the live pipeline says of it, and its ms."""

    run: Run
    part: str
    follows: float
    touches: tuple[Touch, ...]
    told: Deformation | None
    unexplained: str | None
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
    sheets, (thin, wide) = sum(draws.values()) * len(LAWS) * len(seeds), (1e3 * w for w in WIDTHS)
    notes = (
        f"{sheets} sheets of each skin, seeds {seeds}; uneven by 3 to 15 %; stretches of 1 to 5 %; "
        "cylinders of 60 to 240 mm",
        f"folds of {ANGLES[0]} to {ANGLES[1]}° over {thin:.0f} to {wide:.0f} mm, narrower at one "
        f"end, a third hollow: {', '.join(PROFILES)}; sliding: electrodes stay as they are",
        f"bent in {RAMP[0]:g} to {RAMP[1]:g} s, held for {HELD:g} s, pressed, straightened, "
        f"{AFTER:g} s after; a quarter pressed before too",
        "affine: dimensions alone, which the skin file says; percolating: gauge 3 to 8, not said",
    )
    yield table("nobody presses: frames with a touch", _grouped(bent, _untouched), *notes)
    yield table("nobody presses, held: what is told", _grouped(bent, _told))
    yield table("one press of 4 to 8 N on it", _grouped(bent, _pressed))
    flats = [shown for run in _flat(flat, seeds) for shown in followed(run)]
    newtons = f"presses of {FLAT_FORCES[0]:g} to {FLAT_FORCES[1]:g} N"
    yield table("flat sheets", _grouped(flats, _pressed), newtons)
    odd = [shown for run in _others(others, seeds) for shown in followed(run)]
    yield table("what no kind fits, and a gain", _grouped(odd, _other))
    yield table("ms of processor time a frame, median", _grouped(bent + odd, _cost, whole=True))


def followed(run: Run) -> list[Shown]:
    """Frames of a run from its reference on, as the live pipeline shows them."""
    progress(f"{run}")
    bench, out = Bench(run), []
    pipeline = Pipeline(bench.prepared)
    for part, follows, frame in bench.frames():
        begun = time.process_time()
        result = pipeline.push(frame)
        spent = 1e3 * (time.process_time() - begun)
        if part and result is not None and result.ready:
            said = result.touches, result.deformation, result.problem
            out.append(Shown(run, part, follows, *said, spent))
    return out


def _bent(draws: Mapping[str, int], seeds: Sequence[int]) -> Iterator[Run]:
    cases = [(e, law, kind) for e in ELECTRODES for kind in draws for law in LAWS]
    for electrodes, law, kind in cases:
        for seed in (1000 * s + n for s in seeds for n in range(draws[kind])):
            random = np.random.default_rng([seed, electrodes, *kind.encode(), *law.encode()])
            pose, balls, early = _pose(kind, random), _balls(random, 1), random.uniform() < 0.25
            slides = kind == "fold, sliding"
            yield Run(kind, electrodes, law, seed, (pose,), balls, bool(early), slides=slides)


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
            basis, turn = Run("nothing", electrodes, "–", seed), float(random.uniform(0.6, 2.5))
            yield basis
            yield replace(basis, kind="gain step", gain=float(gain))
            two = fold, replace(fold, axis=fold.axis + turn, offset=OFFSETS / 2)
            yield replace(basis, kind="two folds", poses=two)
            far = replace(fold, angle=math.radians(120)) if seed % 2 else Stretch(0.2, -0.08, turn)
            yield replace(basis, kind="far too much", poses=(far,))
            e = int(random.integers(electrodes))
            through = _through(fold, e, electrodes)
            yield replace(basis, kind="through an electrode", poses=(through,), loosened=e)
            yield replace(basis, kind="bent in the reference", poses=(fold,), begins_bent=True)


def _fold(random: np.random.Generator) -> Fold:
    """A third of them hollow."""
    angle = float(random.choice([1, 1, -1]) * np.radians(random.uniform(*ANGLES)))
    axis, offset = random.uniform(0, np.pi), random.uniform(-OFFSETS, OFFSETS)
    width, shrunk, taper = random.uniform((WIDTHS[0], 0.0, -0.25), (WIDTHS[1], 0.25, 0.25)).tolist()
    profile = str(random.choice(list(PROFILES)))
    return Fold(angle, float(axis), float(offset), width, profile, shrunk, taper)


def _through(fold: Fold, electrode: int, electrodes: int) -> Fold:
    """The same fold, narrow, through the middle of an electrode."""
    x, y = stage(electrodes).skin.electrode_centres[electrode].tolist()
    return replace(fold, offset=x * math.sin(fold.axis) - y * math.cos(fold.axis), width=0.02)


def _pose(kind: str, random: np.random.Generator) -> Pose:
    if kind.startswith("fold"):
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
        return _part([bool(one.touches) for one in _of(some, *parts)])

    named = {part: touched(part) for part in UNTOUCHED} | {"after a press": touched("lifted")}
    beyond = [any(gap(t, (0.0, 0.0)) > RADIUS for t in one.touches) for one in some]
    every = {"frames": len(_of(some, *UNTOUCHED)), "all": touched(*UNTOUCHED)}
    return every | named | {"off the sheet": _part(beyond)}


def _told(some: Sequence[Shown]) -> dict[str, Any]:
    held = _of(some, "held")
    errors = [_errors(one, one.told) for one in held if one.told and _is_right(one)]
    found: dict[str, Any] = {
        "frames": len(held),
        "told": _part([one.told is not None for one in held]),
        "kind right": _part([_is_right(one) for one in held]),
    }
    for name, unit, scale in (
        ("axis", "°", 180 / np.pi),
        ("offset", "mm", 1e3),
        ("amount", "%", 1e2),
    ):
        each = [error[name] for error in errors if name in error]
        found[f"{name}, {unit}, median"] = _middle([scale * off for off, _ in each])
        found[f"{name} in 90 %"] = _part([inside for _, inside in each])
    return found


def _is_right(shown: Shown) -> bool:
    if (told := shown.told) is None:
        return False
    round_one = shown.run.kind == "cylinder" and "cylinder" in (told.confused or "")
    return told.kind in RIGHT[shown.run.kind] or round_one


def _errors(shown: Shown, told: Deformation) -> dict[str, tuple[float, bool]]:
    """Of the numbers that are told: how far each is from the truth, of the amount in parts of it,
    and whether its interval holds that."""
    known, out = _truth(shown, told), {}
    if told.axis is not None:
        turns = round((told.axis.value - known["axis"]) / math.pi)
        known["axis"] += turns * math.pi
        if "offset" in known:
            known["offset"] *= (-1) ** turns
    for name, value in known.items():
        if (asked := getattr(told, name)) is not None:
            scale = abs(value) if name == "amount" else 1.0
            out[name] = (abs(asked.value - value) / scale, asked.low <= value <= asked.high)
    return out


def _truth(shown: Shown, told: Deformation) -> dict[str, float]:
    """Numbers of the pose as far as they are defined, in the unit that is told."""
    pose = shown.run.poses[0]
    if told.kind == "fold":
        known = {"axis": pose.axis}
        if isinstance(pose, Fold):
            known["offset"] = pose.offset
        if isinstance(pose, Fold) and told.unit == "rad":
            known["amount"] = shown.follows * pose.angle
        return known
    values, frame = np.linalg.eigh(shown.follows * pose.strain(np.zeros((1, 2)))[0])
    beside, longer = values.tolist()
    changed = float(shown.run.gauges(np.array(longer), np.array(beside))) - 1
    amount = longer if told.unit == "strain" else changed
    axis = {"axis": math.atan2(frame[1, 1], frame[0, 1])}
    return axis | ({"amount": amount} if abs(amount) > LEAST and told.kind == "stretch" else {})


def _pressed(some: Sequence[Shown]) -> dict[str, Any]:
    """Presses found within half of the least distance of two; errors of touches wherever."""
    found, extra, ghosts, far, near = [], [], [], [], []
    on_it = _of(some, "pressed")
    for one in on_it:
        balls, touches = one.run.balls, [touch.detection for touch in one.touches]
        pairs = _pairs(balls, touches)
        within = [(balls[b], touches[t]) for b, t, error in pairs if error < APART / 2]
        far += [error for *_, error in pairs]
        near += [distance(touch, ball.x, ball.y) < INSIDE_90 for ball, touch in within]
        found.append(len(within) == len(balls))
        extra.append(len(touches) > len(balls))
        ghosts.append(len(touches) > len(within))
    return {
        "frames": len(found),
        "all found": _part(found),
        "error, mm, median": _middle([1e3 * error for error in far]),
        "in 90 % ellipse": _part(near),
        "more touches than presses": _part(extra),
        "ghosts": _part(ghosts),
        "none while bending": _part([not s.touches for s in _of(some, "bending pressed")]),
        "deformation told": _part([s.told is not None for s in on_it]),
    }


def _pairs(balls: Sequence[Ball], touches: Sequence[Detection]) -> list[tuple[int, int, float]]:
    if not touches or not balls:
        return []
    return matched(*(np.array([(one.x, one.y) for one in each]) for each in (balls, touches)))


def _other(some: Sequence[Shown]) -> dict[str, Any]:
    told = [one.told for one in _of(some, "held", "after")]
    kinds = Counter("nothing" if one is None else one.kind for one in told)
    named = "; ".join(f"{kind} {100 * n / len(told):.0f} %" for kind, n in kinds.most_common())
    numbers = [one is not None and one.amount is not None for one in told]
    words = [one.unexplained is not None for one in _of(some, "held", "after")]
    mixed = {"told": named, "with a number": _part(numbers), "unexplained": _part(words)}
    return _untouched(some) | mixed


def _cost(some: Sequence[Shown]) -> dict[str, Any]:
    idle = [one for one in some if one.run.kind == "nothing" and one.part == "held"]
    moved = {part: _of(some, part) for part in ("bending", "held", "pressed", "after")}
    named = {"nothing happens": idle} | moved
    return {part: round(float(np.median([s.ms for s in each])), 3) for part, each in named.items()}
