"""Standing presses on every skin, one after the other: torn, doubled, or late."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping
from itertools import product
from typing import Any

import numpy as np
from scipy.spatial import cKDTree

from bench_rig import evenly, gap, held
from report import Floats, Report, mm, progress, table
from tomoskin.model.skin import Skin
from tomoskin.pipeline import prepare
from tomoskin.twin import Press, SteppedSkin, TwinSettings

SEEDS = (41, 42)
"""Nothing was chosen on them; 31 to 33 are there to choose on."""

PRESSES, FORCES, RADII = 200, (3.0, 9.0), (6e-3, 10e-3)
HELD, PAUSE, RAMP = 2.0, 2.0, 0.1
SETTLED, GONE = 0.3, 1.2
"""Seconds from the full force on after which a touch must stand, and from the release on after
which none may."""

MARGIN, NEAR = 0.02, 0.025
"""Metres: of presses from the rim, and of a touch from its press."""

_DISC, _SQUARE = "textile-disc-16", "textile-square-16"
_SLAB = {"shape": "rectangle", "width": "240 mm", "height": "80 mm"}
_ANGLE = [[-80, -80], [80, -80], [80, 0], [0, 0], [0, 80], [-80, 80]]
_CORNERS = {
    **{"shape": "polygon", "width": None, "height": None},
    "vertices": [[f"{v} mm" for v in xy] for xy in _ANGLE],
}

RELEASED_SKINS, RELEASED_SEEDS = ("textile-disc-16", "textile-disc-8"), (21, 22, 23)
"""Nothing here was chosen on these seeds."""

RELEASED = ("first found", "reported in between", "light one found", "reported afterwards")
HEAVY, LIGHT, TRIALS = (5.0, 20.0), (0.5, 1.0, 2.0), 4
FIRST, BETWEEN, AGAIN, AFTER = 5.0, (0.4, 0.9), 0.6, 2.0
QUIET = 0.35
"""Seconds from the start of the release on, after which a reported touch counts as left behind."""

SKINS: dict[str, tuple[str, Mapping[str, Mapping[str, Any]]]] = {
    **{name: (name, {}) for name in ("textile-disc-8", _DISC, "textile-disc-32", _SQUARE)},
    "disc, 12": (_DISC, {"electrodes": {"count": 12}}),
    "disc, 24": (_DISC, {"electrodes": {"count": 24}}),
    "strip 3:1": (_SQUARE, {"outline": _SLAB, "electrodes": {"first": "150 deg"}}),
    "L": (_SQUARE, {"outline": _CORNERS}),
    "cap": (_DISC, {"surface": {"shape": "cap", "radius": "150 mm"}}),
}
"""Of each name a built-in skin, and what of it is changed."""


FAULTS = ("not found", "torn or interrupted", "doubled", "still shown after")


def run() -> Iterator[Report]:
    yield table(
        "standing presses, one after the other",
        (standing(name) for name in SKINS),
        f"textile preset, seeds {SEEDS}, {FORCES[0]:g} to {FORCES[1]:g} N, held for {HELD:g} s "
        f"every {HELD + PAUSE:g} s without a new reference, as a live run shows them",
        f"after: {GONE:g} s after the release",
    )


def standing(name: str) -> dict[str, Any]:
    """Presses, one after the other, on one run of a twin for each seed."""
    base, changes = SKINS[name]
    prepared, faults, away = prepare(Skin.load(base).altered(changes)), Counter[str](), []
    for seed in SEEDS:
        progress(f"{name}, seed {seed}")
        twin = SteppedSkin(prepared, TwinSettings.preset("textile", seed))
        random = np.random.default_rng((seed, 99))
        places = _places(prepared.skin, random, PRESSES)
        forces, radii = random.uniform(*FORCES, PRESSES), random.uniform(*RADII, PRESSES)
        for (x, y), force, radius in zip(places.tolist(), forces, radii, strict=True):
            found, gaps = _one(twin, Press(x, y, float(force), float(radius)))
            faults.update(found)
            away += gaps
    median = mm(np.median(away), digits=1)[0] if away else None
    counts = {fault: faults[fault] for fault in FAULTS}
    presses = PRESSES * len(SEEDS)
    return {"skin, electrodes": name, "presses": presses} | counts | {"median, mm": median}


def _one(twin: SteppedSkin, press: Press) -> tuple[list[str], list[float]]:
    """Faults of one press, and how far its touches are from it, m."""
    ramp = max(round(RAMP / twin.period), 1)
    frames = list(held(twin, (press,), HELD, RAMP))[ramp + round(SETTLED / twin.period) :]
    after = [twin.step(()).touches for _ in range(round(PAUSE / twin.period))]
    near = [[t for t in touches if gap(t, press) < NEAR] for touches in frames]
    ids = {touches[0].id if touches else None for touches in near}
    doubled = any(len(touches) > 1 for touches in frames)
    late = any(after[round(GONE / twin.period) :])
    faults = zip(FAULTS, (ids == {None}, len(ids) > 1, doubled, late), strict=True)
    away = [gap(touches[0], press) for touches in near if touches]
    return [fault for fault, is_so in faults if is_so], away


def _places(skin: Skin, random: np.random.Generator, count: int) -> Floats:
    """(count, 2) m, even over the sheet but for its margin."""
    mesh = skin.mesh()
    sides = np.sort(np.concatenate([mesh.cells[:, pair] for pair in ([0, 1], [1, 2], [0, 2])]))
    side, times = np.unique(np.sort(sides, axis=1), axis=0, return_counts=True)
    rim = mesh.points[np.unique(side[times == 1]), :2]
    inside = np.flatnonzero(cKDTree(rim).query(mesh.centroids[:, :2])[0] > MARGIN)
    return np.asarray(mesh.centroids[random.choice(inside, count), :2])


def run_released() -> Iterator[Report]:
    """What is left after a press: nothing is reported, and a new light press is found."""
    yield table(
        "a light press on the spot of a heavy one, within a second of its release",
        (_released(*case) for case in product(RELEASED_SKINS, HEAVY, LIGHT)),
        f"textile preset, seeds {RELEASED_SEEDS}; the first is held for {FIRST:g} s, the pause "
        f"is {BETWEEN[0]:g} to {BETWEEN[1]:g} s, the light one is held for {AGAIN:g} s",
        f"reported: any touch later than {QUIET:g} s after the start of a release, until "
        f"the light press, or for {AFTER:g} s after it",
    )


def _released(name: str, heavy: float, light: float) -> dict[str, Any]:
    """How often what of RELEASED is true, of a press and a light one after it."""
    progress(f"{name}, {heavy:g} N, then {light:g} N")
    prepared, trials = prepare(Skin.load(name)), []
    for seed, number in product(RELEASED_SEEDS, range(TRIALS)):
        random = np.random.default_rng((seed, number))
        ((x, y),) = evenly(random, 1, 0.07).tolist()
        twin = SteppedSkin(prepared, TwinSettings.preset("textile", seed))
        first = _is_found(twin, Press(x, y, heavy, 10e-3), FIRST)
        between = _is_shown(twin, random.uniform(*BETWEEN))
        again = _is_found(twin, Press(x, y, light, 10e-3), AGAIN)
        trials.append((first, between, again, _is_shown(twin, AFTER)))
    found = zip(RELEASED, np.sum(trials, axis=0).tolist(), strict=True)
    return {"skin": name, "first N": heavy, "then N": light, "presses": len(trials)} | dict(found)


def _is_found(twin: SteppedSkin, press: Press, seconds: float) -> bool:
    """Whether a touch is found at the press while it stands."""
    frames = list(held(twin, (press,), seconds, RAMP))
    return any(gap(touch, press) < 0.02 for touches in frames for touch in touches)


def _is_shown(twin: SteppedSkin, seconds: float) -> bool:
    """Whether anything is reported once a touch should be gone."""
    shown = [bool(twin.step(()).touches) for _ in range(round(seconds / twin.period))]
    return any(shown[round(QUIET / twin.period) :])
