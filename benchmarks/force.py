"""Newtons: presses on the twin and a real fingertip, the bound, and what materials remember."""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from report import Report
from tomoskin.core import Detection, Frame
from tomoskin.learning import ForceModel, ForceProcess, WeighedPresses, identify
from tomoskin.twin import Press
from touch_fit import INSIDE, Lab

SHARED = Path(__file__).parents[2] / "shared" / "data"

SEEDS = (11, 12, 13)
SKIN = "textile-disc-16"
TIPS = (8e-3, 10e-3, 12e-3)
"""Radius of the tip of each seed, given to nobody. Tips of 6 to 15 mm in any order are refused as
contradictory labels: twenty presses do not teach a size."""

LIGHT, HEAVY = 2.0, 20.0
LABELLED, WEIGHED = 20, (0.5, 1.0, 0.5)
HELD_OUT, PAIRS, LOOP = 20, 10, (0.2, 0.5, 0.8, 1.0, 0.8, 0.5, 0.2)
FRAMES, BETWEEN, APART, NEAR = 5, 0.1, 0.06, 0.025

FOLDS = (2, 5)
BLOCKS = {"a block in the middle, 45 to 57 %": (0.45, 0.57), "the last 12 %": (0.88, 1.0)}
TIMES, BREAKDOWN = (3.0, 10.0, 30.0, 100.0, 300.0), (3.0, 10.0, 30.0, 100.0, 300.0)
STRAIN_WIDTHS = (0.02, 0.05, 0.1)

Floats = NDArray[np.float64]


def run(data: Path | None) -> tuple[Report, ...]:
    """The twin needs no recordings; the others are left out where there are none."""
    folder = data or SHARED
    reports = [_bound(), *_twin()]
    if (folder / "eskin_fingertip8").is_dir():
        reports.append(_fingertip(folder / "eskin_fingertip8" / "A2.npz"))
    if (folder / "strip_stretch").is_dir():
        reports.append(_materials(folder))
    return tuple(reports)


# Presses on the twin.


@dataclass(frozen=True)
class Shown:
    """One stage of a press: true force N, what was found of it if anything, the press, s."""

    force: float
    detection: Detection | None
    press: int
    time: float


class Scale:
    """A twin whose presses are weighed; each begins on a sheet that nothing has touched."""

    def __init__(self, seed: int, radii: Sequence[float], skin: str = SKIN) -> None:
        self.lab = Lab(skin, "textile", seed)
        self.random = np.random.default_rng(seed)
        self.radii = radii
        self.finder = self.lab.by_fit()

    def pressed(
        self, tops: Floats, steps: Sequence[float], number: int
    ) -> Iterator[tuple[float, list[Shown]]]:
        """Time s and what is shown of each of ``tops`` N, at every step of the way up and down."""
        lab = self.lab
        places = self._places(len(tops))
        radii = self.random.choice(self.radii, len(tops))
        lab.board.sheet.renew()
        self.finder.push(lab._shown(0 * lab.reference.mean))
        for step in steps:
            forces = LIGHT + (tops - LIGHT) * step
            lab.board.sheet.set_presses(tuple(
                Press(float(x), float(y), float(f), float(r))
                for (x, y), f, r in zip(places, forces, radii, strict=True)
            ))  # fmt: skip
            found = self.finder.push(lab._shown(self._volts() - lab.reference.mean))
            yield (
                lab.time,
                [
                    Shown(float(f), _nearest(found, place), number, lab.time)
                    for f, place in zip(forces, places, strict=True)
                ],
            )

    def _volts(self) -> Floats:
        lab, total = self.lab, 0.0
        for _ in range(FRAMES):
            lab.time += BETWEEN
            samples = lab.board.sample(lab.table, lab.time)
            frame = Frame(0, 0, lab.time, 1, 0, 0, samples)
            total = total + lab.prepared.readout(frame).values
        return np.asarray(total / FRAMES)

    def _places(self, count: int) -> Floats:
        while True:
            away = INSIDE * np.sqrt(self.random.uniform(size=count))
            turn = self.random.uniform(0, 2 * np.pi, count)
            places = np.column_stack([away * np.cos(turn), away * np.sin(turn)])
            if count == 1 or np.linalg.norm(places[0] - places[1]) > APART:
                return places


def _nearest(found: Sequence[Detection], place: Floats) -> Detection | None:
    near = [d for d in found if np.hypot(d.x - place[0], d.y - place[1]) < NEAR]
    return min(near, key=lambda d: np.hypot(d.x - place[0], d.y - place[1]), default=None)


@dataclass(frozen=True)
class Weighed:
    """Force over the true one, and whether the interval held it, of each press (n_presses, …)."""

    ratio: Floats
    held: Floats
    missed: int

    @property
    def error(self) -> float:
        return float(np.nanmean(np.abs(self.ratio - 1)))

    @property
    def inside(self) -> float:
        return float(np.nanmean(self.held))

    @property
    def variation(self) -> float:
        """Over the spots: deviation of each press's mean ratio."""
        return float(np.nanstd(np.nanmean(self.ratio, axis=1)))


def calibrated(scale: Scale) -> ForceModel:
    """Learnt from labelled presses."""
    tops = LIGHT + (HEAVY - LIGHT) * (np.arange(LABELLED) * 0.618 % 1)
    shown = [
        one
        for number, top in enumerate(tops)
        for _, stage in scale.pressed(np.array([top]), WEIGHED, number)
        for one in stage
        if one.detection is not None
    ]
    presses = WeighedPresses.of(
        [one.detection for one in shown],
        *(np.array([getattr(one, key) for one in shown]) for key in ("force", "press", "time")),
    )
    return ForceModel.fit(presses, scale.lab.prepared.skin)


def _weighed(scale: Scale, model: ForceModel, count: int, presses: int) -> Weighed:
    ratio = np.full((presses, count, len(LOOP)), np.nan)
    held = ratio.copy()
    for number in range(presses):
        tops, state = scale.random.uniform(4.0, HEAVY, count), None
        for step, (now, stage) in enumerate(scale.pressed(tops, LOOP, number)):
            seen = [k for k, one in enumerate(stage) if one.detection is not None]
            forces, state = model.read(state, [stage[k].detection for k in seen], now)
            for k, force in zip(seen, forces, strict=True):
                ratio[number, k, step] = force.newtons / stage[k].force
                held[number, k, step] = force.low <= stage[k].force <= force.high
    missed = int(np.isnan(ratio).sum())
    return Weighed(ratio.reshape(-1, len(LOOP)), held.reshape(-1, len(LOOP)), missed)


def _twin() -> tuple[Report, Report]:
    rows, costs = [], []
    ones, twos, left_out = [], [], []
    for seed, radius in zip(SEEDS, TIPS, strict=True):
        scale = Scale(seed, (radius,))
        model = calibrated(scale)
        left_out.append(float(np.abs(model.errors).mean()))
        ones.append(_weighed(scale, model, 1, HELD_OUT))
        twos.append(_weighed(scale, model, 2, PAIRS))
        costs.append(_cost(model))
    for contacts, some in (("one", ones), ("two", twos)):
        rows.append((
            contacts, *(_percent(w.error) for w in some),
            _percent(np.mean([w.error for w in some])),
            _percent(np.mean([w.inside for w in some])),
            round(float(np.mean([w.variation for w in some])), 3),
            _percent(np.mean(left_out)), sum(w.missed for w in some),
        ))  # fmt: skip
    return Report(
        "force of held-out presses on the twin's textile, 16 electrodes",
        (
            *("contacts", *(f"seed {seed}: mean error" for seed in SEEDS)),
            *("mean error", "in 90 % interval", "variation over the skin"),
            *("by labels left out", "not found"),
        ),
        tuple(rows),
        (
            f"{LABELLED} labelled presses of {LIGHT:.0f} to {HEAVY:.0f} N, each weighed half-way "
            f"up, at the top and half-way down; {HELD_OUT} single and {PAIRS} pairs of held-out "
            f"presses, seven forces each on the way up and down, from {LIGHT:.0f} N to a top of 4 "
            f"to {HEAVY:.0f} N; each stage is the mean of {FRAMES} frames",
            "one tip: 8, 10 and 12 mm radius in the three seeds, the same in labelled and held-out "
            "presses; its radius is given to nobody",
            "variation: deviation over presses of the mean of force over true force",
        ),
    ), Report(
        "processor time of a frame beyond the fit of touches, ms",
        ("touches", "median"),
        tuple((count, round(float(np.median([cost[k] for cost in costs])), 3))
              for k, count in enumerate((1, 3))),
        ("state of the spots in, forces and state out; 200 frames",),
    )  # fmt: skip


def _cost(model: ForceModel) -> tuple[float, ...]:
    random, taken = np.random.default_rng(1), []
    presses = model.presses
    for count in (1, 3):
        places = random.uniform(-0.05, 0.05, (count, 2))
        touches = [
            Detection(x, y, 1e-3, 1e-3, float(presses.area[0]), float(presses.peak[0]),
                      np.empty(0, np.int64), snr=20.0)
            for x, y in places.tolist()
        ]  # fmt: skip
        state, start = None, time.process_time()
        for frame in range(200):
            _, state = model.read(state, touches, 0.1 * frame)
        taken.append(1e3 * (time.process_time() - start) / 200)
    return tuple(taken)


def _bound() -> Report:
    lab, rows = Lab(SKIN, "ideal", SEEDS[0]), []
    for x in (0.02, 0.05, 0.075):
        for radius in (8e-3, 15e-3):
            for force in (2.0, 5.0, 20.0):
                unknown, known = _least(lab, Press(x, 0.0, force, radius))
                rows.append((1e3 * x, 1e3 * radius, force, _percent(unknown), _percent(known)))
    return Report(
        "least deviation of a force that one frame allows, 16 electrodes",
        ("from the middle mm", "tip radius mm", "force N", "tip unknown", "tip known"),
        tuple(rows),
        (
            "Cramér–Rao of the twin without memory at the read-out's noise, from its own "
            "derivatives; position unknown; above 100 % it says that nothing is known",
        ),
    )


def _least(lab: Lab, press: Press) -> tuple[float, float]:
    """Relative deviation of the force, radius unknown and known."""
    at = (press.x, press.y, press.force, press.radius)
    slopes = []
    for number, step in enumerate((1e-3, 1e-3, 0.05 * press.force, 0.05 * press.radius)):
        ends = [
            lab.exact(Press(*(v + sign * step * (k == number) for k, v in enumerate(at))))
            for sign in (1, -1)
        ]
        slopes.append((ends[0] - ends[1]) / 2)
    seen = lab.whiten(np.array(slopes))
    information = seen @ seen.T
    all_four, three = np.linalg.inv(information), np.linalg.inv(information[:3, :3])
    return 0.05 * float(np.sqrt(all_four[2, 2])), 0.05 * float(np.sqrt(three[2, 2]))


# A real fingertip.


def _fingertip(path: Path) -> Report:
    with np.load(path) as kept:
        before, during, force, row = (
            kept[key].astype(float) for key in ("before", "during", "force", "row")
        )
    n, rows = len(force), []
    tests = {f"every tenth row, {fold} of 10": row % 10 == fold for fold in FOLDS}
    order = np.arange(n) / n
    tests |= {name: (order >= low) & (order < high) for name, (low, high) in BLOCKS.items()}
    for name, test in tests.items():
        model = ForceProcess.fit(before[~test], during[~test], force[~test])
        found, low, high = model.predict(before[test], during[test])
        true = force[test]
        rows.append((
            name, int(test.sum()), round(float(np.abs(found - true).mean()), 4),
            round(float(np.abs(force[~test].mean() - true).mean()), 4),
            _percent(((low <= true) & (true <= high)).mean()),
            round(float(np.abs(model.left_out - force[~test]).mean()), 4),
        ))  # fmt: skip
    return Report(
        "force on a real fingertip, eskin_fingertip8/A2",
        ("rows left out", "presses", "mean error N", "always the mean", "in 90 % interval",
         "by presses left out"),
        tuple(rows),
        ("newtons presumably; the labels have steps of 0.01. The components that count were chosen "
         "by presses left out of the learning of fold 5",),
    )  # fmt: skip


# What materials remember.


def _materials(folder: Path) -> Report:
    rows = []
    strip = _strip(folder / "strip_stretch" / "1_10_E4pin_20mm_v4_0p3Strain.npz")
    t = strip[0]
    for what, until in (("stretch alone", 440.0), ("until 10 s after release", 472.0)):
        rows += _identified(f"strip, {what}", strip, t < until, STRAIN_WIDTHS)
    rows += _identified("strip, all", strip, t < np.inf, STRAIN_WIDTHS)
    for name in ("A1", "A2", "F1"):
        with np.load(folder / "eskin_fingertip8" / f"straight_{name}.npz") as kept:
            series = tuple(kept[key].astype(float) for key in ("times", "positions", "forces"))
        up = np.arange(len(series[0])) <= np.argmax(series[1]) + 15
        rows += _identified(f"fingertip {name}, in and 30 s out", series, up, (1.0, 2.0, 4.0, 8.0))
    return Report(
        "what real materials remember: root mean square of what the model leaves, % of the span",
        ("recording, fitted on", "no memory: fitted", "held out", "creep and play: fitted",
         "held out", "with breakdown: fitted", "held out"),
        tuple(rows),
        (
            "strip: log of the resistance between the inner contacts against strain; the kinds of "
            "memory were chosen with this recording in view, their numbers on the part named",
            "fingertip: force against indentation, each run by itself",
        ),
    )  # fmt: skip


def _strip(path: Path) -> tuple[Floats, Floats, Floats]:
    """Time s, strain and log resistance: two polarities and ten readings make a value."""
    with np.load(path) as kept:
        columns = kept["columns"].astype(float)
    ten = len(columns) // 20
    pairs = columns[: 20 * ten].reshape(ten, 20, -1)
    t, answer = pairs[:, :, 2].mean(axis=1), np.log(pairs[:, :, 1].mean(axis=1))
    stands = np.diff(columns[:, 3], prepend=columns[0, 3]) < 11.0  # one reading fell to 0
    load = -np.interp(t, columns[stands, 4], columns[stands, 3]) / 40.0
    return t, load, answer - answer[t < 140].mean()


def _identified(
    name: str, series: tuple[Floats, Floats, Floats], fitted: Floats, widths: Sequence[float]
) -> list[tuple[object, ...]]:
    t, load, answer = series
    out: list[object] = [name]
    for options in (
        {},
        {"widths": widths, "times": TIMES},
        {"widths": widths, "times": TIMES, "breakdown_times": BREAKDOWN},
    ):
        fit = identify(t[fitted], load[fitted], answer[fitted], **options)
        left = (fit.predicted(t, load) - answer) / np.ptp(answer)
        out.append(_percent(_rms(left[fitted])))
        out.append(_percent(_rms(left[~fitted])) if (~fitted).any() else "–")
    return [tuple(out)]


def _rms(values: Floats) -> float:
    return float(np.sqrt((values**2).mean()))


def _percent(part: float) -> str:
    return f"{100 * part:.1f} %" if part < 0.2 else f"{100 * part:.0f} %"
