"""Touches fitted to voltages, on uneven sheets and on the twin: found, ghosts, error over bound."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from functools import cache
from typing import Any

import numpy as np

from bench_rig import INSIDE_90, distance, drawn, matched
from report import Report, mm, percent, progress, rms, table
from tomoskin.core import Detection
from touch_lab import APART, FALLS, INSIDE, RADII, PlantLab, TwinLab, drawn_fingers

SEEDS = (11, 12, 13)
SHEETS, PLACEMENTS, IDLE = 3, 9, 30
"""Sheets of each seed, frames of each sheet: 81 frames a case; frames of a reference."""

TWIN_SKINS, PRESETS = ("textile-disc-8", "textile-disc-16"), ("ideal", "textile")
PLACES, TRIPLES = 40, 35
"""Of the twin: single presses and several, of each seed."""


@dataclass(frozen=True)
class Case:
    """A skin by its short name, how many presses, how uneven it is or which preset of the twin it
    has, and which electrode is excluded."""

    skin: str
    presses: int
    sheet: float | str
    excluded: int | None = None
    anywhere: bool = False
    """Whether the nearest touch is that of a press wherever it is."""

    @property
    def columns(self) -> dict[str, Any]:
        """As a table begins with them."""
        uneven = self.sheet if isinstance(self.sheet, str) else f"{100 * self.sheet:.0f} %"
        lost = "–" if self.excluded is None else f"E{self.excluded + 1}"
        return {"skin": self.skin, "presses": self.presses, "uneven": uneven, "excluded": lost}


CASES = (
    *(Case(n, k, u) for n in ("8", "16") for k in (1, 2, 3) for u in (0.1, 0.2)),
    *(Case("square 16", k, 0.1) for k in (1, 2)),
    *(Case("cap 16", k, 0.1) for k in (1, 2, 3)),
    Case("8", 1, 0.1, excluded=2),
    *(Case("16", k, 0.1, excluded=4) for k in (1, 2)),
)
TWIN = (
    *(Case(name, 1, preset, anywhere=True) for name in TWIN_SKINS for preset in PRESETS),
    *(Case(TWIN_SKINS[1], k, preset) for preset in PRESETS for k in (1, 2, 3)),
)


def run() -> Iterator[Report]:
    yield table(
        "flat fingers on uneven sheets",
        (_row(case, _plant_frames(case)) for case in CASES),
        f"seeds {SEEDS}, {len(SEEDS) * SHEETS * PLACEMENTS} frames each, every one alone; "
        f"reference of {IDLE} frames; radii {1e3 * RADII[0]:.0f} to {1e3 * RADII[1]:.0f} mm, "
        f"conductivity down by {100 * FALLS[0]:.0f} to {100 * FALLS[1]:.0f} %, over "
        f"{100 * INSIDE:.0f} % of the breadth, {1e3 * APART:.0f} mm apart at least",
        "all found: each press within half of that; bound: Cramér–Rao of the plant itself",
    )


def run_twin() -> Iterator[Report]:
    """The same on the twin, whose probes are rigid."""
    yield table(
        "flat round probes on the twin",
        (_row(case, _twin_frames(case, PLACES if case.anywhere else TRIPLES)) for case in TWIN),
        f"seeds {SEEDS}, {PLACES} places of one press and then {TRIPLES} of one, two and three; "
        "probes of 8 to 15 mm radius, 2 to 4 N; each frame alone, from a cold start",
        "ideal: read-out noise alone; bound: Cramér–Rao of the twin itself; first rows: wherever "
        "the nearest touch is",
    )


@dataclass
class Scores:
    """Of some frames: whether all was found, and whether there was a ghost; then of each press that
    was found its error m, least error m, and squared Mahalanobis distance."""

    complete: list[bool] = field(default_factory=list)
    ghosts: list[bool] = field(default_factory=list)
    errors: list[float] = field(default_factory=list)
    bounds: list[float] = field(default_factory=list)
    distances: list[float] = field(default_factory=list)

    def add(
        self, presses: Sequence[Any], least: Sequence[float], touches: Sequence[Detection],
        within: float,
    ) -> None:  # fmt: skip
        """Take a frame."""
        places, spots = (np.array([(t.x, t.y) for t in some]) for some in (presses, touches))
        pairs = [p for p in matched(places, spots) if p[2] < within] if touches else []
        for press, touch, error in pairs:
            self.errors.append(error)
            self.bounds.append(least[press])
            self.distances.append(distance(touches[touch], *places[press]))
        self.complete.append(len(pairs) == len(presses))
        self.ghosts.append(len(touches) > len(pairs))

    def columns(self, name: str) -> dict[str, Any]:
        """As tables show them."""
        median, p95, mean = mm(*np.percentile(self.errors, (50, 95)), rms(self.errors))
        return {
            f"{name}: all found": percent(self.complete),
            f"{name}: ghosts": percent(self.ghosts),
            f"{name}: median mm": median,
            f"{name}: p95 mm": p95,
            f"{name}: rms mm": mean,
        }


Frame = tuple[Sequence[Any], Sequence[float], Sequence[Sequence[Detection]]]
"""Presses, their least errors, and touches by fit and by image."""


def _row(case: Case, frames: Iterator[Frame]) -> dict[str, Any]:
    progress(f"{case}")
    fit, image = Scores(), Scores()
    for presses, least, both in frames:
        for scores, touches in zip((fit, image), both, strict=True):
            scores.add(presses, least, touches, np.inf if case.anywhere else APART / 2)
    ratio = round(rms(fit.errors) / rms(fit.bounds), 2)
    over = {
        "rms / bound": "–" if np.isnan(ratio) else ratio,
        "in 90 % ellipse": percent(np.array(fit.distances) < INSIDE_90),
    }
    return case.columns | fit.columns("fit") | over | image.columns("image")


def _plant_frames(case: Case) -> Iterator[Frame]:
    assert isinstance(case.sheet, float)
    for seed in (100 * seed + number for seed in SEEDS for number in range(SHEETS)):
        lab = PlantLab(case.skin, case.sheet, case.excluded, IDLE, seed)
        random = np.random.default_rng([seed, case.presses])
        for _ in range(PLACEMENTS):
            fingers = drawn_fingers(random, lab.skin, case.presses)
            touches = lab.found(fingers)
            yield fingers, lab.least(fingers).tolist(), touches


@cache
def _twin_lab(
    name: str, preset: str, seed: int, drawn_by: int
) -> tuple[TwinLab, np.random.Generator]:
    return TwinLab(name, preset, seed), np.random.default_rng(drawn_by)


def _twin_frames(case: Case, count: int) -> Iterator[Frame]:
    assert isinstance(case.sheet, str)
    for seed in SEEDS:
        drawn_by = seed if case.anywhere else 100 + seed
        lab, random = _twin_lab(case.skin, case.sheet, seed, drawn_by)
        for _ in range(count):
            presses = drawn(random, case.presses)
            touches = lab.found(presses)
            yield presses, lab.least(presses).tolist(), touches
