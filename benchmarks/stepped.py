"""Steps a second of a twin that is pressed step by step, with and without its touches."""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

from report import Report, progress
from tomoskin.model.skin import Skin
from tomoskin.pipeline import prepare
from tomoskin.twin import Press, SteppedSkin, TwinSettings

STEPS, SEED, PROMISED = 500, 11, 1000
COLUMNS = ("skin", "preset", "press", "voltages alone", "with touches", "promised")


def run(data: Path | None) -> tuple[Report, ...]:
    """Count steps in processor time; ``data`` is not needed."""
    del data
    rows = []
    for name in ("textile-disc-8", "textile-disc-16"):
        prepared = prepare(Skin.load(name))
        for preset in ("ideal", "textile"):
            progress(f"{name}, {preset}")
            settings = TwinSettings.preset(preset, SEED)
            both = [SteppedSkin(prepared, settings, with_touches=on) for on in (False, True)]
            for kind, press in PRESSES.items():
                rates = (round(_rate(skin, press)) for skin in both)
                rows.append((name, preset, kind, *rates, PROMISED))
    return (Report("steps a second of processor time, one core", COLUMNS, tuple(rows)),)


def _moving(step: int) -> tuple[Press, ...]:
    return (Press(0.03 * float(np.cos(step / 50)), 0.01, force=5.0, radius=0.012),)


PRESSES: dict[str, Callable[[int], tuple[Press, ...]]] = {
    "moving": _moving,
    "held": lambda _: _moving(0),
    "none": lambda _: (),
}
"""What presses at each step."""


def _rate(skin: SteppedSkin, press: Callable[[int], tuple[Press, ...]]) -> float:
    skin.reset()
    skin.step(press(0))  # the dent of the face is solved once
    begun = time.process_time()
    for step in range(STEPS):
        skin.step(press(step))
    return STEPS / (time.process_time() - begun)
