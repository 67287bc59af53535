"""Touches on a calibrated skin: one, two and three at once, with and without the calibration."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from scipy.optimize import linear_sum_assignment

from report import Report, progress
from tomoskin import Locator, Skin
from tomoskin.core import FloatArray
from tomoskin.files.imports import read_recording
from tomoskin.learning import TOUCH
from tomoskin.pipeline import Prepared, prepare
from tomoskin.run import in_this_process, make_set
from tomoskin.twin import COMMON_PRESSES, Press, SetPlan, SteppedSkin, TwinSettings

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


@dataclass
class Tally:
    """Frames, those in which every press was found, those with more touches; m of the errors."""

    frames: int = 0
    whole: int = 0
    ghosts: int = 0
    errors: list[float] = field(default_factory=list)

    def see(self, found: FloatArray, pressed: FloatArray) -> None:
        """Count a frame of touches (k, 2) m on presses (n, 2) m."""
        self.frames += 1
        self.ghosts += len(found) > len(pressed)
        if len(found) < len(pressed):
            return
        apart = np.linalg.norm(found[:, None] - pressed, axis=2)
        errors = apart[linear_sum_assignment(apart)]
        self.whole += bool((errors < FOUND).all())
        self.errors += errors.tolist()


def run(data: Path | None) -> tuple[Report, ...]:
    """No recordings are needed: the twin is the truth."""
    del data
    return (report(SKINS, SEEDS),)


def report(names: tuple[str, ...], seeds: tuple[int, ...]) -> Report:
    """Of some skins."""
    rows = []
    for name in names:
        skin = Skin.load(name)
        plain = prepare(skin)
        for turn in TURNS:
            fit, ours = ([Tally() for _ in range(3)] for _ in range(2))
            for seed in seeds:
                progress(f"{name}, turned by {turn:g}°, seed {seed}")
                calibrated = _calibrated(plain, seed, turn)
                for count in (1, 2, 3):
                    _scenes(plain, seed, count, turn, fit[count - 1])
                    _scenes(calibrated, seed, count, turn, ours[count - 1])
            for count, (one, other) in enumerate(zip(fit, ours, strict=True), start=1):
                rows.append((f"{name}, {turn:g}°", count, *_columns(one), *_columns(other)))
    return Report(
        "touches on a calibrated skin",
        ("skin, labels turned by", "presses", "all found, %", "ghosts, %", "RMS, mm",
         "calibrated: found, %", "ghosts, %", "RMS, mm"),
        tuple(rows),
        (
            f"textile preset, {LABELLED} labelled presses, seeds {seeds}, {SCENES} scenes of "
            f"{LAST - SETTLED} frames each; found: within {1e3 * FOUND:g} mm",
        ),
    )  # fmt: skip


def _columns(tally: Tally) -> tuple[float, float, float]:
    whole, ghosts = (100 * n / tally.frames for n in (tally.whole, tally.ghosts))
    rms = 1e3 * float(np.sqrt(np.mean(np.square(tally.errors))))
    return round(whole, 1), round(ghosts, 1), round(rms, 1)


def _calibrated(prepared: Prepared, seed: int, turn: float) -> Prepared:
    skin = prepared.skin
    plan = SetPlan(skin.to_toml(), COMMON_PRESSES, "textile", seed, LABELLED)
    with TemporaryDirectory() as folder:
        file = Path(folder) / "presses.npz"
        make_set(plan, file, in_this_process, lambda _done, _total: None)
        recording = read_recording(file).in_order_of(prepared.pattern)
    assert recording.labels is not None
    assert recording.reference is not None
    dv = recording.voltages - recording.reference
    locator = Locator.fit(dv, _turned(recording.labels, turn), skin=skin)
    return prepared.calibrated(TOUCH.of(locator, prepared.pattern, skin))


def _scenes(prepared: Prepared, seed: int, count: int, turn: float, tally: Tally) -> None:
    """Presses that stand, each scene on a twin of its own, with a reference of its own."""
    random = np.random.default_rng((seed, count))
    for scene in range(SCENES):
        places = _places(prepared.skin, random, count)
        presses = [
            Press(x, y, float(force), RADIUS)
            for (x, y), force in zip(places.tolist(), random.uniform(*FORCES, count), strict=True)
        ]
        twin = SteppedSkin(prepared, TwinSettings.preset("textile", 1000 * seed + scene))
        for number in range(LAST):
            part = min(1.0, (number + 1) / RAMP)
            step = twin.step(tuple(replace(p, force=part * p.force) for p in presses))
            if number >= SETTLED:
                found = [(t.detection.x, t.detection.y) for t in step.touches]
                tally.see(np.array(found).reshape(-1, 2), _turned(places, turn))


def _places(skin: Skin, random: np.random.Generator, count: int) -> FloatArray:
    reach = WITHIN * skin.outline.length / (2 * np.pi)
    while True:
        places = random.uniform(-reach, reach, (count, 2))
        apart = np.linalg.norm(places[:, None] - places, axis=2) + np.eye(count)
        if (np.hypot(*places.T) < reach).all() and apart.min() > APART:
            return np.asarray(places)


def _turned(places: FloatArray, degrees: float) -> FloatArray:
    cos, sin = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    return np.asarray(places @ [[cos, sin], [-sin, cos]])
