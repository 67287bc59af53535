"""8, 16 and 32 electrodes at the same read-out: where presses are found, and what a frame costs."""

from __future__ import annotations

import time
from pathlib import Path

import numpy as np

from report import Report, progress
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
COLUMNS = (
    *(
        "electrodes",
        "measurements",
        "set-up, s",
        "reference, s",
        "frame at rest, ms",
        "pressed, ms",
    ),
    *("found", "median error, mm", "p90, mm", "1 N: found", "median, mm"),
)


def run(data: Path | None) -> tuple[Report, ...]:
    """Presses one at a time on the twin; ``data`` is not needed."""
    del data
    return (
        Report(
            "presses found by the fit", COLUMNS, tuple(row(name) for name in SKINS),
            (
                f"200 mm textile twin, {PRESSES} places a seed, seeds {SEEDS}, {FORCES} N in turn, "
                "50 mA, four conversions of 12 bits, as the Pico's front end reads",
                f"found: the touch of the {PRESSED}th frame nearest to the press is within "
                f"{1e3 * NEAR:g} mm",
                "processor time; set-up without what is kept on disk between runs, reference: the "
                "frame in which it is taken",
            ),
        ),
    )  # fmt: skip


def row(name: str) -> tuple[object, ...]:
    """Values under ``COLUMNS``."""
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
    light = errors[forces == FORCES[0]]
    return (
        prepared.pattern.n_electrodes, prepared.pattern.n_meas, f"{set_up:.1f}",
        f"{max(rest.max(), pressed.max()):.1f}", f"{1e3 * np.median(rest):.1f}",
        f"{1e3 * np.median(pressed):.1f}", *_figures(errors),
        f"{np.percentile(_of(errors), 90):.1f}",
        *_figures(light),
    )  # fmt: skip


def _of(errors: FloatArray) -> FloatArray:
    return 1e3 * errors[errors < NEAR]


def _figures(errors: FloatArray) -> tuple[str, str]:
    return f"{len(_of(errors))} of {len(errors)}", f"{np.median(_of(errors)):.1f}"


def measured(prepared: Prepared, seed: int) -> tuple[FloatArray, ...]:
    """Errors m (infinite: none), forces N, s a frame at rest and pressed."""
    random, pipeline = np.random.default_rng(seed), Pipeline(prepared)
    transport = open_twin(f"fast,seed={seed}", prepared.skin)
    errors, rest, pressed = [], [], []
    forces = np.resize(FORCES, PRESSES)
    with Link(transport, prepared.scan, ScanSettings.of(prepared.skin)) as link:
        _pushed(link, pipeline, IDLE, rest)
        for force in forces:
            x, y = _place(random)
            transport.set_presses((Press(x, y, force, RADIUS),))
            touches = _pushed(link, pipeline, PRESSED, pressed)
            apart = [np.hypot(t.detection.x - x, t.detection.y - y) for t in touches]
            errors.append(min(apart, default=np.inf))
            transport.set_presses(())
            _pushed(link, pipeline, FREE, rest)
    return np.array(errors), forces, np.array(rest), np.array(pressed)


def _place(random: np.random.Generator) -> tuple[float, float]:
    radius = (0.1 - MARGIN) * np.sqrt(random.random())
    angle = 2 * np.pi * random.random()
    return float(radius * np.cos(angle)), float(radius * np.sin(angle))


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
