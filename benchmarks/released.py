"""What is left after a press on the twin: nothing is reported, and a new light press is found."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from report import Report, progress
from tomoskin.model.skin import Skin
from tomoskin.pipeline import Prepared, prepare
from tomoskin.twin import Press, SteppedSkin, TwinSettings

SEEDS = (21, 22, 23)
"""Nothing here was chosen on them."""

SKINS = ("textile-disc-16", "textile-disc-8")
HEAVY, LIGHT = (5.0, 20.0), (0.5, 1.0, 2.0)
PRESSES = 4
"""Of each pair of forces and each seed."""

HELD, PAUSE, AGAIN, AFTER, RAMP = 5.0, (0.4, 0.9), 0.6, 2.0, 0.1
GONE = 0.35
"""Seconds from the start of the release on, after which a reported touch counts as left behind."""

RADIUS, INSIDE, NEAR = 10e-3, 0.07, 0.02


@dataclass(frozen=True)
class Trial:
    """One press and a light one after it: whether each was found, a touch between and after."""

    first: bool
    between: bool
    again: bool
    after: bool


def run(data: Path | None) -> tuple[Report, ...]:
    """No recordings are needed: the twin is the truth."""
    del data
    rows = []
    for name in SKINS:
        prepared = prepare(Skin.load(name))
        for heavy in HEAVY:
            for light in LIGHT:
                progress(f"{name}, {heavy:g} N, then {light:g} N")
                trials = [t for seed in SEEDS for t in _trials(prepared, seed, heavy, light)]
                counts = (
                    sum(getattr(t, what) for t in trials)
                    for what in ("first", "again", "between", "after")
                )
                rows.append((name, heavy, light, len(trials), *counts))
    return (
        Report(
            "a light press on the spot of a heavy one, within a second of its release",
            ("skin", "first N", "then N", "presses", "first found", "light one found",
             "reported in between", "reported afterwards"),
            tuple(rows),
            (
                f"textile preset, seeds {SEEDS}; the first is held for {HELD:g} s, the pause is "
                f"{PAUSE[0]:g} to {PAUSE[1]:g} s, the light one is held for {AGAIN:g} s",
                f"reported: any touch later than {GONE:g} s after the start of a release, until "
                f"the light press, or for {AFTER:g} s after it",
            ),
        ),
    )  # fmt: skip


def _trials(prepared: Prepared, seed: int, heavy: float, light: float) -> Iterator[Trial]:
    twin = SteppedSkin(prepared, TwinSettings.preset("textile", seed))
    for number in range(PRESSES):
        random = np.random.default_rng((seed, number))
        away, turn = INSIDE * np.sqrt(random.uniform()), random.uniform(0, 2 * np.pi)
        press = Press(float(away * np.cos(turn)), float(away * np.sin(turn)), heavy, RADIUS)
        again = Press(press.x, press.y, light, RADIUS)
        twin.reset(seed)
        first = _held(twin, press, HELD)
        between = _idle(twin, random.uniform(*PAUSE))
        second = _held(twin, again, AGAIN)
        yield Trial(first, between, second, _idle(twin, AFTER))


def _held(twin: SteppedSkin, press: Press, seconds: float) -> bool:
    """Whether a touch is found at the press while it stands."""
    ramp, found = max(round(RAMP / twin.period), 1), False
    for step in range(ramp + round(seconds / twin.period)):
        force = press.force * min(1.0, (step + 1) / ramp)
        touches = twin.step((Press(press.x, press.y, force, press.radius),)).touches
        found |= any(
            np.hypot(t.detection.x - press.x, t.detection.y - press.y) < NEAR for t in touches
        )
    return found


def _idle(twin: SteppedSkin, seconds: float) -> bool:
    """Whether anything is reported once a touch should be gone."""
    shown = [bool(twin.step(()).touches) for _ in range(round(seconds / twin.period))]
    return any(shown[round(GONE / twin.period) :])
