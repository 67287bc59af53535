"""Flat fingers on uneven sheets, independent of twin and fit: found, ghosts, error over bound."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from scipy.optimize import linear_sum_assignment

from plant import Finger, Floats, Plant, plant_mesh
from report import Report, progress
from tomoskin.core import Detection
from tomoskin.learning import Differences, FrameView
from tomoskin.model.mesh import Mesh
from tomoskin.model.skin import Skin
from tomoskin.pipeline import prepare
from tomoskin.pipeline.finding import Finder, finder_of
from tomoskin.pipeline.nuisance import JUMP
from tomoskin.pipeline.prepare import Prepared
from tomoskin.pipeline.tune import tuned, tuned_sheet
from tomoskin.sensing.signal import NuisanceSubspace, Reference
from tomoskin.sensing.signal.health import Roles

SEEDS = (11, 12, 13)
SHEETS, PLACEMENTS = 3, 9
"""Sheets of each seed, and frames of each sheet: 81 frames a case."""

IDLE = 30
INSIDE, APART = 0.85, 0.045
RADII, FALLS = (0.012, 0.020), (0.15, 0.35)
INSIDE_90 = 4.605

CAP = {"surface": {"shape": "cap", "radius": "100 mm"}}

_SKINS: dict[str, tuple[str, dict[str, Any]]] = {
    "8": ("textile-disc-8", {}),
    "16": ("textile-disc-16", {}),
    "square 16": ("textile-square-16", {}),
    "cap 16": ("textile-disc-16", CAP),
}


@dataclass(frozen=True)
class Case:
    """A skin by its short name, how uneven it is, how many presses, which electrode is excluded."""

    skin: str
    presses: int
    uneven: float
    excluded: int | None = None

    @property
    def columns(self) -> tuple[object, ...]:
        """As a table begins with them."""
        lost = "–" if self.excluded is None else f"E{self.excluded + 1}"
        return self.skin, self.presses, f"{100 * self.uneven:.0f} %", lost


CASES = (
    *(Case(n, k, u) for n in ("8", "16") for k in (1, 2, 3) for u in (0.0, 0.1, 0.2)),
    *(Case("square 16", k, 0.1) for k in (1, 2)),
    *(Case("cap 16", k, 0.1) for k in (1, 2, 3)),
    Case("8", 1, 0.1, excluded=2),
    *(Case("16", k, 0.1, excluded=4) for k in (1, 2)),
)


def run(data: Path | None) -> tuple[Report, ...]:
    """No recordings are needed: the plant is the truth."""
    del data
    return (table(CASES, SEEDS, SHEETS),)


def table(cases: Sequence[Case], seeds: Sequence[int], sheets: int) -> Report:
    """Each case by both methods."""
    rows = []
    for case in cases:
        progress(f"{case}")
        by_fit, by_image = scores(case, seeds, sheets, PLACEMENTS)
        rows.append((*case.columns, *by_fit.columns, *by_image.columns[:4]))
    frames = len(seeds) * sheets * PLACEMENTS
    return Report(
        "flat fingers on uneven sheets",
        (
            *("skin", "presses", "uneven by", "excluded", "fit: all found", "ghosts", "median mm"),
            *("rms mm", "rms / bound", "in 90 % ellipse"),
            *("image: all found", "ghosts", "median mm", "rms mm"),
        ),
        tuple(rows),
        (
            f"seeds {tuple(seeds)}, {frames} frames each, every one alone; reference of {IDLE} "
            f"frames; radii {1e3 * RADII[0]:.0f} to {1e3 * RADII[1]:.0f} mm, conductivity down by "
            f"{100 * FALLS[0]:.0f} to {100 * FALLS[1]:.0f} %, over {100 * INSIDE:.0f} % of the "
            f"breadth, {1e3 * APART:.0f} mm apart at least",
            "all found: each press within half of that; ghosts: frames with another touch; bound: "
            "Cramér–Rao of the plant itself, places, radii and strengths unknown",
        ),
    )


@dataclass(frozen=True, eq=False)
class Scores:
    """Of some frames: bool each whether all was found, and whether there was a ghost; then of each
    press that was found its error m, least error m, and squared Mahalanobis distance."""

    complete: Floats
    ghosts: Floats
    errors: Floats
    bounds: Floats
    distances: Floats

    @property
    def columns(self) -> tuple[object, ...]:
        """As tables show them."""
        rms, least = (float(np.sqrt(np.mean(v**2))) for v in (self.errors, self.bounds))
        return (
            f"{100 * self.complete.mean():.0f} %",
            f"{100 * self.ghosts.mean():.0f} %",
            *(round(1e3 * v, 2) for v in (float(np.median(self.errors)), rms)),
            round(rms / least, 2),
            f"{100 * np.mean(self.distances < INSIDE_90):.0f} %",
        )


def scores(case: Case, seeds: Sequence[int], sheets: int, placements: int) -> tuple[Scores, Scores]:
    """By fit and by image."""
    by_fit, by_image = [], []
    for seed in seeds:
        for number in range(sheets):
            lab = Lab(case, seed=100 * seed + number)
            for _ in range(placements):
                fingers = drawn(lab.random, lab.skin, case.presses)
                dv, least = lab.change(fingers), lab.least(fingers)
                by_fit.append(_scored(fingers, least, lab.found(lab.by_fit, dv)))
                by_image.append(_scored(fingers, least, lab.found(lab.by_image, dv)))
    return _together(by_fit), _together(by_image)


class Lab:
    """A plant, its reference, and the finders of its skin."""

    def __init__(self, case: Case, seed: int) -> None:
        self.skin, mesh, fit, image = _stages(case.skin)
        self.random = np.random.default_rng([seed, case.presses])
        self.plant = Plant(self.skin, mesh, case.uneven, seed)
        self.lost = _rows_of(self.skin, case.excluded)
        self.reference = Reference.of(self.plant.frames((), IDLE))
        self.noise = self.plant.noise(IDLE).without(np.eye(len(self.lost))[:, self.lost])
        image = tuned(image, self.reference)
        lost = np.eye(len(self.lost))[:, self.lost]
        self._image = image.without_directions(lost) if lost.shape[1] else image
        self._nuisance = NuisanceSubspace.of(
            np.column_stack([self.reference.mean, lost]), self._image.operator.precision
        )
        self._floor = self._image.image_noise(self.reference, self._nuisance)
        fit = tuned_sheet(fit, self.reference, self.lost)
        self.by_fit = finder_of(fit, self.reference)
        self.by_image = finder_of(self._image, self.reference)

    def found(self, finder: Finder, change: Floats) -> Sequence[Detection]:
        """Touches of a frame of this ``change`` (n_meas,) V after one in which nothing touches."""
        finder.push(self._view(0 * change))
        return finder.push(self._view(change))

    def change(self, fingers: Sequence[Finger]) -> Floats:
        """(n_meas,) V by which one frame differs from the reference."""
        return np.asarray(self.plant.frames(fingers)[0] - self.reference.mean)

    def least(self, fingers: Sequence[Finger]) -> Floats:
        """(k,) m, the bound of each."""
        return self.plant.least(fingers, self.noise)

    def _view(self, change: Floats) -> FrameView:
        """What one frame shows; all voltages in proportion say nothing, as they do live."""
        dv = self._nuisance(change)
        differences = Differences(
            dv=dv,
            nuisance=self._nuisance.directions,
            whole=change,
            unknown=np.eye(len(self.lost))[:, self.lost],
            jumps=JUMP * self.reference.mean[:, None],
            change=change,
            drift=self._nuisance.directions,
            from_rest=change,
            excluded=self.lost,
        )
        return FrameView(0.0, self._image.operator(dv), self._floor, differences)


@cache
def _stages(name: str) -> tuple[Skin, Mesh, Prepared, Prepared]:
    built_in, changes = _SKINS[name]
    skin = Skin.load(built_in).altered(changes)
    fit = prepare(skin.altered({"touch": {"method": "fit"}}))
    image = prepare(skin.altered({"touch": {"method": "image"}}))
    return skin, plant_mesh(skin), fit, image


def _rows_of(skin: Skin, electrode: int | None) -> np.ndarray:
    """(n_meas,) bool: rows that drive or read that electrode."""
    if electrode is None:
        return np.zeros(skin.pattern().n_meas, dtype=bool)
    roles = Roles.of(skin.pattern())
    return np.asarray(roles.drives[electrode] | roles.reads[electrode])


def drawn(random: np.random.Generator, skin: Skin, count: int) -> tuple[Finger, ...]:
    """Fingers at places drawn evenly over the inner part of the sheet, far enough apart."""
    rim = INSIDE * skin.outline.polyline(skin.outline.length / 200)
    low, high = rim.min(axis=0), rim.max(axis=0)
    while True:
        places = random.uniform(low, high, (count, 2))
        gaps = np.linalg.norm(places[:, None] - places, axis=2)[np.triu_indices(count, 1)]
        if (gaps >= APART).all() and all(_encloses(rim, place) for place in places):
            radii, falls = random.uniform(*RADII, count), random.uniform(*FALLS, count)
            each = np.column_stack([places, radii, falls]).tolist()
            return tuple(Finger(*values) for values in each)


def _encloses(rim: Floats, point: Floats) -> bool:
    """Whether a convex ``rim`` (n, 2), counter-clockwise, goes round the point."""
    along, towards = np.roll(rim, -1, axis=0) - rim, point - rim
    return bool((along[:, 0] * towards[:, 1] >= along[:, 1] * towards[:, 0]).all())


def _scored(fingers: Sequence[Finger], least: Floats, found: Sequence[Detection]) -> Scores:
    errors, bounds, distances = [], [], []
    apart = np.array([[np.hypot(d.x - f.x, d.y - f.y) for d in found] for f in fingers])
    pairs = zip(*linear_sum_assignment(apart), strict=True) if found else ()
    for press, detection in pairs:
        if apart[press, detection] >= APART / 2:
            continue
        one, other = fingers[press], found[detection]
        error = np.array([other.x - one.x, other.y - one.y])
        spread = np.array([[other.sd_x**2, other.cov_xy], [other.cov_xy, other.sd_y**2]])
        errors.append(float(np.linalg.norm(error)))
        bounds.append(least[press])
        distances.append(float(error @ np.linalg.solve(spread, error)))
    complete, ghost = len(errors) == len(fingers), len(found) > len(errors)
    return Scores(*(np.array(v, float) for v in ([complete], [ghost], errors, bounds, distances)))


def _together(parts: Sequence[Scores]) -> Scores:
    columns = ("complete", "ghosts", "errors", "bounds", "distances")
    return Scores(*(np.concatenate([getattr(p, name) for p in parts]) for name in columns))
