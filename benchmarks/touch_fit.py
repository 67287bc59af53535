"""Touches fitted to voltages, on the twin: errors against the Cramér–Rao bound, numbers, cost."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment

from report import Report
from tomoskin.board.source import ScanSettings
from tomoskin.board.wire import Drive
from tomoskin.core import Detection, Frame
from tomoskin.learning import Differences, FrameView
from tomoskin.model.skin import Skin
from tomoskin.pipeline import prepare
from tomoskin.pipeline.finding import Finder, finder_of
from tomoskin.pipeline.nuisance import JUMP
from tomoskin.pipeline.tune import tuned, tuned_sheet
from tomoskin.sensing.fit import Whitener, row_covariance
from tomoskin.sensing.signal import Reference
from tomoskin.twin import (
    Press,
    SampleTable,
    ScanClock,
    TwinSettings,
    make_electronics,
    sample_table,
)

SEEDS = (11, 12, 13)
SKINS = ("textile-disc-8", "textile-disc-16")
SHEETS = {"ideal": "read-out noise alone", "textile": "all of the textile preset"}
IDLE, HOLD = 20, 1.0
PLACES, TRIPLES, QUIET = 40, 35, 200
INSIDE, APART = 0.085, 0.045
RADII, FORCES = (8e-3, 10e-3, 12e-3, 15e-3), (2.0, 4.0)
INSIDE_90 = 4.605

Floats = NDArray[np.float64]


def run(data: Path | None) -> tuple[Report, ...]:
    """No recordings are needed: the twin is the truth."""
    del data
    return _places(), _numbers(), _cost()


class Lab:
    """A twin and the finders of its skin; before each reading nothing has pressed."""

    def __init__(self, name: str, preset: str, seed: int) -> None:
        self.skin = Skin.load(name)
        self.board = make_electronics(self.skin, TwinSettings.preset(preset, seed))
        self.time = 0.0
        fit = prepare(self.skin.altered({"touch": {"method": "fit"}}))
        self.prepared, self.table = fit, _table(self.skin, fit.scan)
        idle = np.array([self.volts(()) for _ in range(IDLE)])
        self.reference = Reference.of(idle)
        image = prepare(self.skin.altered({"touch": {"method": "image"}}))
        image, on_sheet = tuned(image, self.reference), tuned_sheet(fit, self.reference)
        self.image = image.operator
        self.by_fit = lambda: finder_of(on_sheet, self.reference)
        self.by_image = lambda: finder_of(image, self.reference)
        self.floor = image.image_noise(self.reference)
        noise = fit.readout.noise / np.sqrt(2) * np.sqrt(1 + 1 / IDLE)
        self.whiten = Whitener.of(row_covariance(fit.scan, noise))

    def volts(self, presses: Sequence[Press]) -> Floats:
        """(n_meas,) V as the board reads them."""
        self.board.sheet.renew()
        self.board.sheet.set_presses(tuple(presses))
        self.time += HOLD
        samples = self.board.sample(self.table, self.time)
        return self.prepared.readout(Frame(0, 0, self.time, 1, 0, 0, samples)).values

    def view(self, presses: Sequence[Press]) -> FrameView:
        """What one frame shows."""
        return self._shown(self.volts(presses) - self.reference.mean)

    def _shown(self, dv: Floats) -> FrameView:
        """What all voltages have in common may jump, as it may live."""
        differences = Differences(
            dv=dv,
            nuisance=self.reference.mean[:, None],
            whole=dv,
            unknown=np.zeros((len(dv), 0)),
            jumps=JUMP * self.reference.mean[:, None],
            change=dv,
            drift=np.zeros((len(dv), 0)),
            from_rest=dv,
            excluded=np.zeros(len(dv), bool),
        )
        return FrameView(0.0, self.image(dv), self.floor, differences)

    def exact(self, press: Press) -> Floats:
        """(n_meas,) V of the sheet without any noise."""
        sheet = self.board.sheet
        sheet.renew()
        sheet.set_presses((press,))
        sheet.advance(HOLD)
        return sheet.model.voltages(sheet.resistance())

    def bound(self, press: Press) -> float:
        """Least root mean square error, m: place, force and radius unknown, all else known."""
        at = (press.x, press.y, press.force, press.radius)
        slopes = []
        for number, step in enumerate((1e-3, 1e-3, 0.05 * press.force, 0.05 * press.radius)):
            ends = [
                self.exact(Press(*(v + sign * step * (k == number) for k, v in enumerate(at))))
                for sign in (1, -1)
            ]
            slopes.append((ends[0] - ends[1]) / 2)  # by one step, so that all are alike in size
        seen = self.whiten(np.array(slopes))
        least = np.linalg.inv(seen @ seen.T)
        return 1e-3 * float(np.sqrt(np.trace(least[:2, :2])))


def _table(skin: Skin, scan: object) -> SampleTable:
    settings = ScanSettings.of(skin)
    drives = [
        Drive(source, sink, mask)
        for (source, sink), mask in zip(scan.drives.tolist(), scan.masks.tolist(), strict=True)
    ]
    clock = ScanClock(settings.dead_time, settings.settling, settings.conversion)
    return sample_table(drives, settings.oversampling, clock)


def drawn(random: np.random.Generator, count: int) -> tuple[Press, ...]:
    """Presses at places drawn evenly, no two nearer than they may be."""
    while True:
        away = INSIDE * np.sqrt(random.uniform(size=count))
        turn = random.uniform(0, 2 * np.pi, count)
        places = np.column_stack([away * np.cos(turn), away * np.sin(turn)])
        gaps = np.linalg.norm(places[:, None] - places, axis=2)[np.triu_indices(count, 1)]
        if (gaps >= APART).all():
            sizes, forces = random.choice(RADII, count), random.uniform(*FORCES, count)
            return tuple(
                Press(float(x), float(y), float(f), float(r))
                for (x, y), f, r in zip(places, forces, sizes, strict=True)
            )


@dataclass(frozen=True)
class Missed:
    """Errors m and squared Mahalanobis distances of the nearest readings; how many there were."""

    errors: Floats
    distances: Floats
    counts: Floats

    @classmethod
    def of(cls, presses: Sequence[Press], readings: Sequence[Sequence[Detection]]) -> Missed:
        errors, distances = [], []
        for press, found in zip(presses, readings, strict=True):
            best = min(found, key=lambda r: np.hypot(r.x - press.x, r.y - press.y), default=None)
            if best is None:
                continue
            error = np.array([best.x - press.x, best.y - press.y])
            spread = np.array([[best.sd_x**2, best.cov_xy], [best.cov_xy, best.sd_y**2]])
            errors.append(np.linalg.norm(error))
            distances.append(error @ np.linalg.solve(spread, error))
        return cls(np.array(errors), np.array(distances), np.array([len(r) for r in readings]))


def _places() -> Report:
    rows = []
    for name in SKINS:
        for preset, what in SHEETS.items():
            presses, bounds, fitted, has_image = [], [], [], []
            for seed in SEEDS:
                lab, random = Lab(name, preset, seed), np.random.default_rng(seed)
                for _ in range(PLACES):
                    (press,) = drawn(random, 1)
                    view = lab.view((press,))
                    presses.append(press)
                    bounds.append(lab.bound(press))
                    fitted.append(lab.by_fit().push(view))
                    has_image.append(lab.by_image().push(view))
            found, seen = Missed.of(presses, fitted), Missed.of(presses, has_image)
            bound, rms = np.array(bounds), np.sqrt(np.mean(found.errors**2))
            held = found.distances < INSIDE_90
            rows.append((
                name, what,
                *_mm(np.sqrt(np.mean(bound**2)), rms, *_quantiles(found.errors)),
                round(float(rms / np.sqrt(np.mean(bound**2))), 2),
                f"{100 * held.mean():.0f} %",
                *_mm(*_quantiles(seen.errors)),
                f"{100 * np.mean(found.counts == 1):.0f} %",
            ))  # fmt: skip
    return Report(
        "one press, over 85 % of the radius",
        (
            *("skin", "sheet", "bound rms mm", "fit rms mm", "median mm", "p95 mm", "rms / bound"),
            *("in 90 % ellipse", "image median mm", "image p95 mm", "one touch reported"),
        ),
        tuple(rows),
        (
            f"seeds {SEEDS}, {PLACES} places each; flat round probes of {1e3 * RADII[0]:.0f} to "
            f"{1e3 * RADII[-1]:.0f} mm radius, {FORCES[0]:.0f} to {FORCES[1]:.0f} N; "
            f"reference of {IDLE} frames; each frame alone, from a cold start",
            "bound: Cramér–Rao of the twin itself at the read-out's noise, by its own derivatives; "
            "place, force and radius unknown",
        ),
    )


def _numbers() -> Report:
    rows = []
    for preset, what in SHEETS.items():
        labs = [(Lab(SKINS[1], preset, seed), np.random.default_rng(100 + seed)) for seed in SEEDS]
        for count in (1, 2, 3):
            scores = []
            for lab, random in labs:
                for _ in range(TRIPLES):
                    presses = drawn(random, count)
                    scores.append(_matched(presses, lab.by_fit().push(lab.view(presses))))
            hits, ghosts = np.array([s[:2] for s in scores]).T
            errors = np.concatenate([s[2] for s in scores])
            rows.append((
                what, count, f"{100 * np.mean(hits == count):.0f} %",
                f"{100 * np.mean(ghosts == 0):.0f} %", *_mm(*_quantiles(errors)),
            ))  # fmt: skip
    return Report(
        "several presses at once, 16 electrodes",
        ("sheet", "presses", "all found", "no ghost", "median mm", "p95 mm"),
        tuple(rows),
        (
            f"textile-disc-16, seeds {SEEDS}, {TRIPLES} placements each, at least "
            f"{1e3 * APART:.0f} mm apart; found: within half of that; ghost: any other touch",
        ),
    )


def _matched(presses: Sequence[Press], found: Sequence[Detection]) -> tuple[int, int, Floats]:
    """Presses that were found, readings of none, and errors of the former."""
    if not found:
        return 0, 0, np.empty(0)
    apart = np.array([[np.hypot(r.x - p.x, r.y - p.y) for r in found] for p in presses])
    errors = apart[linear_sum_assignment(apart)]
    near = errors[errors < APART / 2]
    return len(near), len(found) - len(near), near


def _cost() -> Report:
    rows = []
    for name in SKINS:
        lab, random = Lab(name, "ideal", SEEDS[0]), np.random.default_rng(7)
        quiet = [lab.view(()) for _ in range(QUIET)]
        alarms, idle = _timed(lab.by_fit(), quiet)
        rows.append((name, "nothing", f"{sum(map(bool, alarms))} of {QUIET}", *idle, "–"))
        for count in (1, 2, 3):
            onsets, frames, most = [], [], []
            for _ in range(10):
                presses = drawn(random, count)
                finder = lab.by_fit()
                finder.push(lab.view(()))
                _, (onset, *_) = _timed(finder, [lab.view(presses)])
                moved = [_moved(presses, 1e-3 * step) for step in range(1, 11)]
                _, (median, longest) = _timed(finder, [lab.view(p) for p in moved])
                onsets.append(onset)
                frames.append(median)
                most.append(longest)
            figures = round(float(np.median(frames)), 1), round(max(most), 1)
            rows.append((name, count, "–", *figures, round(float(np.median(onsets)), 1)))
    return Report(
        "processor time of a frame, ms",
        ("skin", "presses", "false alarms", "median", "longest", "first frame, median"),
        tuple(rows),
        (
            "median and longest: 10 frames after the first, the presses moving 1 mm a frame; "
            "frames of the untouched skin: each begins with nothing",
        ),
    )


def _moved(presses: Sequence[Press], by: float) -> tuple[Press, ...]:
    """Towards the middle."""
    out = []
    for p in presses:
        left = 1 - by / max(np.hypot(p.x, p.y), by)
        out.append(Press(p.x * left, p.y * left, p.force, p.radius))
    return tuple(out)


def _timed(
    finder: Finder, views: Sequence[FrameView]
) -> tuple[list[list[Detection]], Sequence[float]]:
    """Readings, and median and longest processor time, ms."""
    found, taken = [], []
    for view in views:
        start = time.process_time()
        found.append(finder.push(view))
        taken.append(1e3 * (time.process_time() - start))
    return found, (round(float(np.median(taken)), 1), round(max(taken), 1))


def _quantiles(errors: Floats) -> tuple[float, float]:
    return float(np.median(errors)), float(np.percentile(errors, 95))


def _mm(*values: float) -> tuple[float, ...]:
    return tuple(round(1e3 * float(v), 2) for v in values)
