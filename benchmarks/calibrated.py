"""Touches on a calibrated skin: one, two and three at once, with and without the calibration."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import islice
from typing import Any

import numpy as np

from bench_rig import far_apart, held, labelled_presses
from report import Floats, Report, progress, table
from tomoskin import Locator, Skin
from tomoskin.learning import TOUCH
from tomoskin.pipeline import Prepared, prepare
from tomoskin.twin import Press, SteppedSkin, TwinSettings
from touch_plant import Scores

SKINS = ("textile-disc-8", "textile-disc-16")
SEEDS = (41, 42, 43)
"""Nothing was chosen on them; 31 to 33 are there to choose on."""

LABELLED, SCENES = 60, 20
APART, WITHIN = 0.05, 0.8
"""m between presses, and part of the radius that they are in."""

FORCES, RADIUS = (3.0, 8.0), 8e-3
RAMP, SETTLED, LAST = 3, 8, 24
"""Frames until a press has its force, from which it is looked at, and of a scene."""

FOUND = 0.03
"""m within which a touch is that of its press."""

TURNS = (0.0, 14.0)
"""Degrees by which labels are turned against the skin file: its first electrode is wrong."""


def run() -> Iterator[Report]:
    yield table(
        "touches on a calibrated skin",
        (row for name in SKINS for turn in TURNS for row in _rows(name, turn)),
        f"textile preset, {LABELLED} labelled presses, seeds {SEEDS}, {SCENES} scenes of "
        f"{LAST - SETTLED} frames each; found: within {1e3 * FOUND:g} mm",
    )


def _rows(name: str, turn: float) -> Iterator[dict[str, Any]]:
    plain = prepare(Skin.load(name))
    tallies = [(Scores(), Scores()) for _ in range(3)]
    for seed in SEEDS:
        progress(f"{name}, turned by {turn:g}°, seed {seed}")
        dv, xy = labelled_presses(plain.skin, seed, LABELLED)
        locator = Locator.fit(dv, _turned(xy, turn), skin=plain.skin)
        calibrated = plain.calibrated(TOUCH.of(locator, plain.pattern, plain.skin))
        for count, both in enumerate(tallies, start=1):
            for prepared, tally in zip((plain, calibrated), both, strict=True):
                _scenes(prepared, seed, count, turn, tally)
    for count, (fit, ours) in enumerate(tallies, start=1):
        skin = {"skin, labels turned by": f"{name}, {turn:g}°", "presses": count}
        yield skin | fit.columns("fit") | ours.columns("calibrated")


def _scenes(prepared: Prepared, seed: int, count: int, turn: float, scores: Scores) -> None:
    """Presses that stand, each scene on a twin of its own, with a reference of its own."""
    random = np.random.default_rng((seed, count))
    for scene in range(SCENES):
        places = _places(prepared.skin, random, count)
        forces = random.uniform(*FORCES, count).tolist()
        each = zip(places.tolist(), forces, strict=True)
        presses = [Press(*place, force, RADIUS) for place, force in each]
        twin = SteppedSkin(prepared, TwinSettings.preset("textile", 1000 * seed + scene))
        frames = held(twin, presses, LAST * twin.period, RAMP * twin.period)
        there = [Press(*place, 1.0, RADIUS) for place in _turned(places, turn).tolist()]
        for touches in islice(frames, SETTLED, LAST):
            scores.add(there, [0.0] * count, [touch.detection for touch in touches], FOUND)


def _places(skin: Skin, random: np.random.Generator, count: int) -> Floats:
    reach = WITHIN * skin.outline.length / (2 * np.pi)
    while True:
        places = np.asarray(random.uniform(-reach, reach, (count, 2)))
        if (np.hypot(*places.T) < reach).all() and far_apart(places, APART):
            return places


def _turned(places: Floats, degrees: float) -> Floats:
    cos, sin = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    return np.asarray(places @ [[cos, sin], [-sin, cos]])
