"""8, 16 and 32 electrodes at the same read-out: where presses are found, and what a frame costs."""

from __future__ import annotations

import time
from collections.abc import Iterator
from typing import Any

import numpy as np

from report import Report, progress, table
from rig import evenly, gap
from tomoskin.board.source import Link, ScanSettings
from tomoskin.core import FloatArray, Frame, Touch
from tomoskin.model.skin import Skin
from tomoskin.pipeline import Pipeline, Prepared, prepare
from tomoskin.twin import Press, open_twin

SKINS = ("textile-disc-8", "textile-disc-16", "textile-disc-32")
SEEDS, PRESSES = (101, 102), 30
FORCES, RADIUS, MARGIN = (1.0, 2.0, 5.0), 0.01, 0.012
IDLE, PRESSED, FREE = 60, 6, 4
NEAR = 0.0225


def run() -> Iterator[Report]:
    yield table(
        "presses found by the fit",
        map(row, SKINS),
        f"200 mm textile twin, {PRESSES} places a seed, seeds {SEEDS}, {FORCES} N in turn, "
        "50 mA, four conversions of 12 bits, as the Pico's front end reads",
        f"found: the touch of the {PRESSED}th frame nearest to the press is within "
        f"{1e3 * NEAR:g} mm",
        "processor time; set-up without what is kept on disk between runs, reference: the "
        "frame in which it is taken",
    )


def row(name: str) -> dict[str, Any]:
    """Values of one skin."""
    began = time.process_time()
    pico = Skin.load("textile-disc-32").readout
    skin = Skin.load(name).altered(
        {
            "drive": {"current": "50 mA"},
            "readout": {
                "adc_bits": pico.adc_bits,
                "reference_voltage": f"{pico.reference_voltage} V",
                "gain": pico.gain,
                "oversampling": pico.oversampling,
                "settling": f"{1e6 * pico.settling} us",
            },
        }
    )
    prepared = prepare(skin)
    prepared.warm_up()
    set_up = time.process_time() - began
    parts = []
    for seed in SEEDS:
        progress(f"{name}, seed {seed}")
        parts.append(measured(prepared, seed))
    errors, forces = (np.concatenate([part[k] for part in parts]) for k in (0, 1))
    rest, pressed = (np.concatenate([part[k] for part in parts]) for k in (2, 3))
    near, light = errors < NEAR, forces == FORCES[0]
    found = 1e3 * errors[near]
    return {
        "electrodes": prepared.pattern.n_electrodes,
        "measurements": prepared.pattern.n_meas,
        "set-up, s": f"{set_up:.1f}",
        "reference, s": f"{max(rest.max(), pressed.max()):.1f}",
        "frame at rest, ms": f"{1e3 * np.median(rest):.1f}",
        "pressed, ms": f"{1e3 * np.median(pressed):.1f}",
        "found": f"{near.sum()} of {len(errors)}",
        "median error, mm": f"{np.median(found):.1f}",
        "p90, mm": f"{np.percentile(found, 90):.1f}",
        "1 N: found": f"{(near & light).sum()} of {light.sum()}",
        "1 N: median, mm": f"{1e3 * np.median(errors[near & light]):.1f}",
    }


def measured(prepared: Prepared, seed: int) -> tuple[FloatArray, ...]:
    """Errors m (infinite: none), forces N, s a frame at rest and pressed."""
    random, pipeline = np.random.default_rng(seed), Pipeline(prepared)
    transport = open_twin(f"fast,seed={seed}", prepared.skin)
    errors, rest, pressed = [], [], []
    forces = np.resize(FORCES, PRESSES)
    with Link(transport, prepared.scan, ScanSettings.of(prepared.skin)) as link:
        _pushed(link, pipeline, IDLE, rest)
        for force in forces:
            ((x, y),) = evenly(random, 1, 0.1 - MARGIN).tolist()
            transport.set_presses((Press(x, y, force, RADIUS),))
            touches = _pushed(link, pipeline, PRESSED, pressed)
            errors.append(min((gap(t, (x, y)) for t in touches), default=np.inf))
            transport.set_presses(())
            _pushed(link, pipeline, FREE, rest)
    return np.array(errors), forces, np.array(rest), np.array(pressed)


def _pushed(link: Link, pipeline: Pipeline, count: int, spent: list[float]) -> tuple[Touch, ...]:
    """The touches of the last of the next ``count`` frames; s of each are added to ``spent``."""
    touches: tuple[Touch, ...] = ()
    while count:
        for frame in link.poll(1.0):
            if isinstance(frame, Frame) and count:
                began = time.process_time()
                result = pipeline.push(frame)
                spent.append(time.process_time() - began)
                touches = result.touches if result else ()
                count -= 1
    return touches
