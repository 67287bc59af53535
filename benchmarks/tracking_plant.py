"""Fingers that slide, meet and part on an independent plant: ghosts, delays, identities."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from itertools import product
from typing import Any

import numpy as np
from scipy.optimize import linear_sum_assignment

from bench_rig import gap, scan_time, stage
from report import Report, percent, progress, table
from tomoskin.pipeline import FrameResult, Pipeline
from tomoskin.pipeline.pipeline import REFERENCE_FRAMES
from touch_lab import Finger, Plant, sheet_mesh

UNEVEN = 0.1
RAMP = 0.05
"""Seconds in which a finger comes down, and in which it is lifted."""

SETTLED = 260
"""Idle frames before a scene: the reference, and those in which the sheet is learnt from it."""

SPEED, APART, INSIDE = 0.06, 0.045, 0.075
RADII, FALLS = (0.012, 0.020), (0.15, 0.35)
STRAYS = 0.015
"""Two that meet pass each other, or stop, at up to so many metres: closer than is told apart."""


@dataclass(frozen=True)
class Slide:
    """A finger from ``start`` to ``end`` s along ``path``, rows of s, x and y m."""

    finger: Finger
    start: float
    end: float
    path: tuple[tuple[float, float, float], ...]

    def at(self, time: float) -> Finger | None:
        """It at a moment; None where it does not touch."""
        depth = min((time - self.start) / RAMP, (self.end - time) / RAMP, 1.0)
        if depth <= 0:
            return None
        times, x, y = np.array(self.path).T
        here = {"x": float(np.interp(time, times, x)), "y": float(np.interp(time, times, y))}
        return replace(self.finger, **here, fall=self.finger.fall * depth)


@dataclass(frozen=True)
class Shown:
    """What the pipeline makes of a frame, and its number, begin and end in s of the scene."""

    result: FrameResult
    number: int
    begin: float
    end: float


class Sheet:
    """A plant with a pipeline that has its reference: one scene after the other."""

    def __init__(self, electrodes: int, seed: int) -> None:
        prepared = stage(electrodes)
        self.plant = Plant(prepared.skin, sheet_mesh(f"{electrodes}"), UNEVEN, seed)
        self.pipeline = Pipeline(prepared)
        self._interval, self._number = scan_time(prepared), 0
        for _ in range(REFERENCE_FRAMES + SETTLED):
            self._push((), 0.0)

    def scene(self, slides: Sequence[Slide], seconds: float) -> Iterator[Shown]:
        """Frames of a scene, and of half a second without anything after it."""
        for number in range(round((seconds + 0.5) / self._interval)):
            begin = number * self._interval
            result = self._push(slides, begin)
            assert result is not None
            yield Shown(result, number, begin, begin + self._interval)

    def _push(self, slides: Sequence[Slide], begin: float) -> FrameResult | None:
        moments = (begin, begin + self._interval / 2, begin + self._interval)
        pressed = [[f for slide in slides if (f := slide.at(time))] for time in moments]
        frame = self.plant.scan_of(*pressed)
        now = self._number * self._interval
        ticks = round(now * self.pipeline.tick_rate)
        self._number += 1
        return self.pipeline.push(replace(frame, sequence=self._number, ticks=ticks, host_time=now))


def moving(random: np.random.Generator, count: int) -> tuple[list[Slide], float]:
    """Fingers that come at different times, slide at 60 mm/s, never near each other, and go."""
    while True:
        slides = [_course(random) for _ in range(count)]
        times = np.linspace(0, 3.4, 69)
        ways = [
            np.column_stack([np.interp(times, *np.array(s.path).T[[0, k]]) for k in (1, 2)])
            for s in slides
        ]
        gaps = [
            np.linalg.norm(ways[i] - ways[j], axis=1).min() for i in range(count) for j in range(i)
        ]
        if min(gaps, default=APART) >= APART:
            return slides, 3.4


def _course(random: np.random.Generator) -> Slide:
    """From one place to another, over 0.5 to 1.5 s, then it stands."""
    start, end = random.uniform(0.2, 1.0), random.uniform(2.4, 3.2)
    while True:
        ends = random.uniform(-INSIDE, INSIDE, (2, 2))
        far = float(np.linalg.norm(ends[1] - ends[0]))
        if (np.linalg.norm(ends, axis=1) < INSIDE).all() and 0.03 < far < 0.09:
            break
    go = start + 0.3
    path = ((0.0, *ends[0]), (go, *ends[0]), (go + far / SPEED, *ends[1]))
    return Slide(_finger(random), start, end, path)


def quick(random: np.random.Generator) -> tuple[list[Slide], float]:
    """Six taps of 0.2 s, 0.1 s after each other, each 60 mm from the last at least."""
    slides: list[Slide] = []
    place = np.array([np.inf, np.inf])
    for number in range(6):
        while True:
            fresh = random.uniform(-INSIDE, INSIDE, 2)
            if np.linalg.norm(fresh) < INSIDE and not np.linalg.norm(fresh - place) < 0.06:
                break
        place, start = fresh, 0.2 + 0.3 * number
        slides.append(Slide(_finger(random), start, start + 0.2, ((0.0, *place),)))
    return slides, 2.2


def past(random: np.random.Generator) -> tuple[list[Slide], float]:
    """Two fingers from 90 mm apart past each other, as far on; with one speed."""
    middle, along, across = _line(random)
    stray, speed = random.uniform(0, STRAYS), random.uniform(0.04, 0.10)
    slides, going = [], 0.09 / speed
    for side in (1, -1):
        a, b = (middle + side * (s * 0.045 * along + stray / 2 * across) for s in (1, -1))
        path = ((0.0, *a), (0.8, *a), (0.8 + going, *b))
        slides.append(Slide(_finger(random), 0.2, 1.4 + going, path))
    return slides, 1.4 + going


def together(random: np.random.Generator) -> tuple[list[Slide], float]:
    """Two fingers from 90 mm apart to each other, a rest of up to 0.6 s, and back."""
    middle, along, _ = _line(random)
    near, speed = random.uniform(0.004, STRAYS), random.uniform(0.04, 0.10)
    rest, going = random.uniform(0.1, 0.6), (0.045 - 0.5 * near) / speed
    slides, back = [], 0.8 + going + rest
    for side in (1, -1):
        a, b = middle + side * 0.045 * along, middle + side * near / 2 * along
        path = ((0.0, *a), (0.8, *a), (0.8 + going, *b), (back, *b), (back + going, *a))
        slides.append(Slide(_finger(random), 0.2, back + going + 0.6, path))
    return slides, back + going + 0.6


def _line(random: np.random.Generator) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    angle = random.uniform(0, 2 * np.pi)
    along = np.array([np.cos(angle), np.sin(angle)])
    return random.uniform(-0.02, 0.02, 2), along, np.array([-along[1], along[0]])


def _finger(random: np.random.Generator) -> Finger:
    return Finger(0.0, 0.0, random.uniform(*RADII), random.uniform(*FALLS))


SEEDS = (11, 12, 13)
"""What was chosen was chosen on seeds 1 to 3."""

SCENES = 5
"""Of each kind on each sheet."""

ELECTRODES = (8, 16)
"""Of the built-in skins: 18 and 10 frames a second."""

KINDS: dict[str, Callable[[np.random.Generator], tuple[list[Slide], float]]] = {
    "past": past,
    "together": together,
    "quick": quick,
    "one": lambda random: moving(random, 1),
    "two": lambda random: moving(random, 2),
    "three": lambda random: moving(random, 3),
}
MEETINGS = ("past", "together")
NEAR, ALMOST, FAR = 0.0225, 0.030, 0.060
LATE = 99


@dataclass
class Scores:
    """Frames, those with a ghost, and with more touches than fingers; identities given, and
    fingers; of each finger the frame in which it was reported, and in which it was gone, from 1; of
    meetings what became of who is who, by kind."""

    frames: int = 0
    ghosts: int = 0
    surplus: int = 0
    ids: int = 0
    fingers: int = 0
    onsets: list[int] = field(default_factory=list)
    releases: list[int] = field(default_factory=list)
    who: dict[str, Counter[str]] = field(
        default_factory=lambda: {kind: Counter() for kind in MEETINGS}
    )

    def add(self, kind: str, slides: Sequence[Slide], shown: Sequence[Shown]) -> None:
        """Take a scene."""
        self.frames += len(shown)
        self.ghosts += sum(has_ghost(frame, slides) for frame in shown)
        self.surplus += sum(len(f.result.touches) > len(_present(f, slides)) for f in shown)
        touches = [touch for frame in shown for touch in frame.result.touches]
        self.ids += len({number for t in touches for number in (t.merged or (t.id,))})
        self.fingers += len(slides)
        for slide in slides:
            self.onsets.append(onset(slide, shown))
            if kind != "quick":  # the next one is there before this is gone
                self.releases.append(release(slide, shown))
        if kind in MEETINGS:
            self.who[kind][identity(slides, shown)] += 1


def run() -> Iterator[Report]:
    yield table(
        "fingers that move, on uneven sheets",
        map(_row, ELECTRODES),
        f"seeds {SEEDS}, {SCENES} scenes of each kind; radii 12 to 20 mm, conductivity "
        f"down by 15 to 35 %, up and down in {1e3 * RAMP:.0f} ms, sheet uneven by 10 %",
        f"ghost: a touch farther than {1e3 * NEAR:.1f} mm from every finger of its own that "
        "presses or has been lifted two frames ago, and not said to be several",
        "first frame: in whose middle half of the finger is down; meetings: ids at the end",
    )


def _row(electrodes: int) -> dict[str, Any]:
    scores = Scores()
    for seed in SEEDS:
        sheet = Sheet(electrodes, seed)
        for (index, (kind, drawn)), number in product(enumerate(KINDS.items()), range(SCENES)):
            progress(f"{electrodes} electrodes, seed {seed}, {kind} {number}")
            slides, seconds = drawn(np.random.default_rng([seed, index, number]))
            scores.add(kind, slides, list(sheet.scene(slides, seconds)))
    onsets, releases = np.array(scores.onsets), np.array(scores.releases)
    past, parted = (
        ", ".join(f"{n} {w}" for w, n in scores.who[kind].most_common()) for kind in MEETINGS
    )
    return {
        "electrodes": electrodes,
        "frames": scores.frames,
        "with a ghost, of 1,000": round(1000 * scores.ghosts / scores.frames, 1),
        "with one too many": round(1000 * scores.surplus / scores.frames, 1),
        "reported in their first frame": percent(onsets <= 1),
        "in two": percent(onsets <= 2),
        "at all": percent(onsets < LATE),
        "gone in three": percent(releases <= 3),
        "identities": f"{scores.ids} for {scores.fingers}",
        "past each other": past,
        "together and apart": parted,
    }


def has_ghost(frame: Shown, slides: Sequence[Slide]) -> bool:
    """Whether a touch is not where a finger is."""
    touches, here = frame.result.touches, _present(frame, slides)
    alone = {k for k, t in enumerate(touches) if not t.merged and not t.detection.close}
    if not touches or not here:
        return bool(alone)
    away = np.array([[gap(t, _held(s, frame)) for t in touches] for s in here])
    pairs = zip(*linear_sum_assignment(away), strict=True)
    return bool(alone - {int(k) for finger, k in pairs if away[finger, k] < NEAR})


def _present(frame: Shown, slides: Sequence[Slide]) -> list[Slide]:
    """Those that are down, or have been up to two frames ago."""
    grace = 2 * (frame.end - frame.begin)
    return [s for s in slides if s.start < frame.end and frame.begin < s.end + grace]


def onset(slide: Slide, shown: Sequence[Shown]) -> int:
    """Number of the frame in which it is reported, counted from the first that holds half of it."""
    first = next(f.number for f in shown if (f.begin + f.end) / 2 >= slide.start + RAMP / 2)
    seen = (
        f for f in shown if first - 2 <= f.number and f.begin < slide.end and _is_seen(slide, f)
    )
    return next((f.number - first + 1 for f in seen), LATE)


def release(slide: Slide, shown: Sequence[Shown]) -> int:
    """Number of the frame in which it is gone, counted from the first without it."""
    gone = next(f.number for f in shown if f.begin >= slide.end)
    free = (f.number - gone + 1 for f in shown if f.number >= gone - 1 and not _is_seen(slide, f))
    return next(free, LATE)


def identity(slides: Sequence[Slide], shown: Sequence[Shown]) -> str:
    """Whether two fingers that have met end as who they were: right, wrong, unsure, new, never two.

    Counted are frames with two touches near them; they began more than 60 mm apart.
    """
    first, last, unsure = None, None, False
    for frame in shown:
        touches = frame.result.touches
        down = [s for s in slides if s.start + RAMP < frame.begin and frame.end < s.end - RAMP]
        if len(down) < 2 or len(touches) != 2 or any(t.merged for t in touches):
            continue
        fingers = [_held(s, frame) for s in down]
        away = np.array([[gap(t, f) for f in fingers] for t in touches])
        swapped = int(away[0, 0] + away[1, 1] > away[0, 1] + away[1, 0])
        if max(away[0, swapped], away[1, 1 - swapped]) > ALMOST:
            continue
        owners = {touches[k].id: k ^ swapped for k in (0, 1)}
        apart = np.hypot(fingers[0].x - fingers[1].x, fingers[0].y - fingers[1].y)
        first = owners if first is None and apart > FAR else first
        last, unsure = owners, any(t.possible for t in touches)
    if first is None or last is None:
        return "never two"
    if set(first) != set(last):
        return "new"
    return "unsure" if unsure else "right" if first == last else "wrong"


def _is_seen(slide: Slide, frame: Shown) -> bool:
    finger = _held(slide, frame)
    return any(gap(touch, finger) < ALMOST for touch in frame.result.touches)


def _held(slide: Slide, frame: Shown) -> Finger:
    """It in the middle of a frame, or the moment nearest to that in which it is down."""
    middle = (frame.begin + frame.end) / 2
    finger = slide.at(min(max(middle, slide.start + 1e-3), slide.end - 1e-3))
    assert finger is not None
    return finger
