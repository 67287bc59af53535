"""Standing presses on every skin, one after the other: torn, doubled, or late."""

from __future__ import annotations

import sys
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial import cKDTree

from report import Report, progress
from tomoskin.core import FloatArray, Touch
from tomoskin.model.skin import Skin
from tomoskin.pipeline import Prepared, prepare
from tomoskin.twin import Press, SteppedSkin, TwinSettings

SEEDS = (41, 42)
"""Nothing was chosen on them; 31 to 33 are there to choose on."""

PRESSES = 200
FORCES, RADII = (3.0, 9.0), (6e-3, 10e-3)
HELD, PAUSE, RAMP = 2.0, 2.0, 0.1
SETTLED, GONE = 0.3, 1.2
"""Seconds from the full force on after which a touch must stand, and from the release on after
which none may."""

MARGIN, NEAR = 0.02, 0.025
"""Metres: of presses from the rim, and of a touch from its press."""

_DISC, _SQUARE = "textile-disc-16", "textile-square-16"
_SLAB = {"shape": "rectangle", "width": "240 mm", "height": "80 mm"}
_ANGLE = [[-80, -80], [80, -80], [80, 0], [0, 0], [0, 80], [-80, 80]]
_CORNERS = {"shape": "polygon", "width": None, "height": None}

Changes = Mapping[str, Mapping[str, Any]]

SKINS: dict[str, tuple[str, Changes]] = {
    "textile-disc-8": ("textile-disc-8", {}),
    "textile-disc-16": (_DISC, {}),
    "textile-disc-32": ("textile-disc-32", {}),
    "textile-square-16": (_SQUARE, {}),
    "disc, 12": (_DISC, {"electrodes": {"count": 12}}),
    "disc, 24": (_DISC, {"electrodes": {"count": 24}}),
    "strip 3:1": (_SQUARE, {"outline": _SLAB, "electrodes": {"first": "150 deg"}}),
    "L": (
        _SQUARE,
        {"outline": {**_CORNERS, "vertices": [[f"{v} mm" for v in xy] for xy in _ANGLE]}},
    ),
    "cap": (_DISC, {"surface": {"shape": "cap", "radius": "150 mm"}}),
}
"""Of each name a built-in skin, and what of it is changed."""


@dataclass
class Counts:
    """Presses that were missed, torn into several or interrupted, shown twice, shown afterwards;
    and distances of touches from them, m."""

    missed: int = 0
    torn: int = 0
    doubled: int = 0
    late: int = 0
    away: tuple[float, ...] = ()

    def add(self, other: Counts) -> None:
        """Count those of ``other`` too."""
        for name, value in vars(other).items():
            setattr(self, name, getattr(self, name) + value)


def run(data: Path | None) -> tuple[Report, ...]:
    """No recordings are needed: the twin is the truth."""
    del data
    return (report(tuple(SKINS), SEEDS, PRESSES),)


def report(names: tuple[str, ...], seeds: tuple[int, ...], presses: int) -> Report:
    """Of some skins."""
    rows = []
    for name in names:
        base, changes = SKINS[name]
        prepared, counts = prepare(Skin.load(base).altered(changes)), Counts()
        for seed in seeds:
            progress(f"{name}, seed {seed}")
            counts.add(standing(prepared, seed, presses))
        median = 1e3 * float(np.median(counts.away)) if counts.away else None
        rows.append(
            (
                name,
                presses * len(seeds),
                counts.missed,
                counts.torn,
                counts.doubled,
                counts.late,
                None if median is None else round(median, 1),
            )
        )
    return Report(
        "standing presses, one after the other",
        ("skin, electrodes", "presses", "not found", "torn or interrupted", "doubled",
         "still shown after", "median, mm"),
        tuple(rows),
        (
            f"textile preset, seeds {seeds}, {FORCES[0]:g} to {FORCES[1]:g} N, held for {HELD:g} s "
            f"every {HELD + PAUSE:g} s without a new reference, as a live run shows them",
            f"after: {GONE:g} s after the release",
        ),
    )  # fmt: skip


def standing(prepared: Prepared, seed: int, presses: int) -> Counts:
    """So many presses, one after the other, on one run of a twin."""
    twin = SteppedSkin(prepared, TwinSettings.preset("textile", seed))
    random, counts = np.random.default_rng((seed, 99)), Counts()
    places = _places(prepared.skin, random, presses)
    forces, radii = random.uniform(*FORCES, presses), random.uniform(*RADII, presses)
    for (x, y), force, radius in zip(places.tolist(), forces, radii, strict=True):
        counts.add(_one(twin, Press(x, y, float(force), float(radius))))
    return counts


def _one(twin: SteppedSkin, press: Press) -> Counts:
    ramp = max(round(RAMP / twin.period), 1)
    frames: list[tuple[Touch, ...]] = []
    for step in range(ramp + round(HELD / twin.period)):
        force = press.force * min(1.0, (step + 1) / ramp)
        frames.append(twin.step((Press(press.x, press.y, force, press.radius),)).touches)
    frames = frames[ramp + round(SETTLED / twin.period) :]
    after = [twin.step(()).touches for _ in range(round(PAUSE / twin.period))]
    near = [[t for t in touches if _away(t, press) < NEAR] for touches in frames]
    ids = {touches[0].id if touches else None for touches in near}
    return Counts(
        missed=ids == {None},
        torn=len(ids) > 1,
        doubled=any(len(touches) > 1 for touches in frames),
        late=any(after[round(GONE / twin.period) :]),
        away=tuple(_away(touches[0], press) for touches in near if touches),
    )


def _places(skin: Skin, random: np.random.Generator, count: int) -> FloatArray:
    """(count, 2) m, even over the sheet but for its margin."""
    mesh = skin.mesh()
    sides = np.sort(np.concatenate([mesh.cells[:, pair] for pair in ([0, 1], [1, 2], [0, 2])]))
    side, times = np.unique(np.sort(sides, axis=1), axis=0, return_counts=True)
    rim = mesh.points[np.unique(side[times == 1]), :2]
    inside = np.flatnonzero(cKDTree(rim).query(mesh.centroids[:, :2])[0] > MARGIN)
    return np.asarray(mesh.centroids[random.choice(inside, count), :2])


def _away(touch: Touch, press: Press) -> float:
    return float(np.hypot(touch.detection.x - press.x, touch.detection.y - press.y))


if __name__ == "__main__":
    # Some of it: python benchmarks/standing.py 31 200 textile-disc-8 "disc, 24"
    made = report(tuple(sys.argv[3:]), (int(sys.argv[1]),), int(sys.argv[2]))
    print(*(" | ".join(map(str, row)) for row in (made.columns, *made.rows)), sep="\n")
