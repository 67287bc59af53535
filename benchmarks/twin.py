"""The twin: frames per second with three moving presses, stage by stage, on one core."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from itertools import product
from typing import Any

import numpy as np

from bench_rig import Rig
from report import Report, spent, table
from tomoskin.model.forward import State
from tomoskin.model.skin import Skin
from tomoskin.pipeline import prepare
from tomoskin.twin import Press, SteppedSkin, TwinSettings, TwinSkin

CASES = (
    ("textile-disc-16", "ideal", 3000),
    ("textile-disc-16", "textile", 3000),
    ("textile-disc-16", "ideal", 4800),
    ("textile-disc-8", "textile", 1056),
    ("tank-16", "tank", 3000),
)
FRAMES, ROUND, CHECKED, SEED = 300, 100, 20, 1
STEPS, STEPPED_SEED = 500, 11


def run() -> Iterator[Report]:
    yield table(
        "twin: presses → counts",
        (row(*case) for case in CASES),
        f"{FRAMES} frames, each with three flat round presses of 12 mm and 3 N that have moved "
        f"on a circle since the frame before; seed {SEED}",
        f"off: largest difference to a model's whole solve over {CHECKED} frames, at the "
        "amplifiers, as a part of the read-out noise of a sample; promised: a tenth",
    )


def run_steps() -> Iterator[Report]:
    """Steps a second of a twin that is pressed step by step, with and without its touches."""
    cases = product(("textile-disc-8", "textile-disc-16"), ("ideal", "textile"), STEPPED)
    yield table("steps a second of processor time, one core", (_stepped(*case) for case in cases))


def row(name: str, preset: str, triangles: int) -> dict[str, Any]:
    """One case."""
    settings = TwinSettings.preset(preset, SEED)
    cells = round(triangles / settings.mesh_ratio)
    skin = Skin.load(name).altered({"mesh": {"cells": cells}})
    rig = Rig(skin, preset, SEED)
    sheet = rig.board.sheet

    def frame(number: int) -> Callable[[], object]:
        presses, moment = _presses(number, skin), number * rig.interval

        def sampled() -> object:
            sheet.set_presses(presses)
            return rig.board.sample(rig.table, moment)

        return sampled

    for number in range(10):
        frame(number)()
    taken = [(spent(frame(k)), *_stages(sheet, _presses(k, skin))) for k in range(10, FRAMES)]
    whole, dent, sigma, solve = 1e3 * np.median(taken, axis=0)
    quiet = 1e3 * float(np.percentile([times[0] for times in taken], 10))
    return {
        "skin": name,
        "preset": preset,
        "triangles": len(sheet.model.mesh.cells),
        "dent ms": round(float(dent), 3),
        "material ms": round(float(sigma), 3),
        "solve ms": round(float(solve), 3),
        "whole frame ms": round(float(whole), 3),
        "frames /s": round(float(1e3 / whole)),
        "best tenth": round(1e3 / quiet),
        "× real time": round(float(1e3 / whole * rig.interval), 1),
        "off, of noise": float(f"{_off(sheet, skin, settings):.1g}"),
    }


def _off(sheet: TwinSkin, skin: Skin, settings: TwinSettings) -> float:
    """Largest difference to the exact model, as a part of a sample's noise."""
    readout, wrong = skin.readout, 0.0
    for number in range(CHECKED):
        sheet.set_presses(_presses(number, skin))
        ours, sigma = sheet.resistance(), sheet.conductivity()
        exact = State(sheet.model, sigma).transfer_resistance
        wrong = max(wrong, float(np.abs(ours - exact).max()))
    code = readout.reference_voltage / readout.gain / (1 << readout.adc_bits)
    return skin.current * wrong / (settings.electronics.noise * code / readout.oversampling**0.5)


def _stages(sheet: TwinSkin, presses: tuple[Press, ...]) -> tuple[float, float, float]:
    """s of dent, material and solve: each is asked for by itself and kept for the next."""
    sheet.set_presses(())
    sheet.resistance()
    dent = spent(lambda: sheet.set_presses(presses))
    return dent, spent(sheet.conductivity), spent(sheet.resistance)


def _presses(number: int, skin: Skin) -> tuple[Press, ...]:
    turn = 2 * np.pi * (number / ROUND + np.arange(3) / 3)
    reach = 0.5 * float(np.linalg.norm(skin.electrode_centres, axis=1).min())
    places = reach * np.column_stack([np.cos(turn), np.sin(turn)])
    return tuple(Press(x, y, 3.0, 0.012) for x, y in places.tolist())


STEPPED: dict[str, Callable[[int], tuple[Press, ...]]] = {
    "moving": lambda step: (Press(0.03 * float(np.cos(step / 50)), 0.01, 5.0, 0.012),),
    "held": lambda _: (Press(0.03, 0.01, 5.0, 0.012),),
    "none": lambda _: (),
}


def _stepped(name: str, preset: str, press: str) -> dict[str, Any]:
    prepared, settings = prepare(Skin.load(name)), TwinSettings.preset(preset, STEPPED_SEED)
    return {"skin": name, "preset": preset, "press": press} | {
        what: round(_rate(SteppedSkin(prepared, settings, with_touches=on), STEPPED[press]))
        for what, on in (("voltages alone", False), ("with touches", True))
    }


def _rate(skin: SteppedSkin, press: Callable[[int], tuple[Press, ...]]) -> float:
    skin.reset()
    skin.step(press(0))  # the dent of the face is solved once
    begun = time.process_time()
    for step in range(STEPS):
        skin.step(press(step))
    return STEPS / (time.process_time() - begun)
