"""Bends on the twin: touches on cylinders, while bending, by a joint's angle; angles and states."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from report import Report
from tomoskin.core import FloatArray, Frame, Reading
from tomoskin.live.finding import View, finding, voltage_covariance
from tomoskin.mesh import Cylinder, Hinge
from tomoskin.signal import Reference
from tomoskin.touch import BendExamples, BendModel, BendReader, JointReference
from tomoskin.twin import Bent, Pose, Press
from touch_fit import HOLD, Lab, drawn

SEEDS = (11, 12, 13)
SHEETS = {"ideal": "no memory, no hysteresis", "textile": "all of the textile preset"}
STRIP, FARTHEST = 0.06, 60.0
TURNS = ((60, 10), (30, 10), (45, 15))
"""Of the calibration: as far as so many degrees and back, in such steps."""

IDLE, FRAMES, PERIOD = 20, 60, 24
TOUCHED = (1, 2, 4, 5)
"""Of six frames, those with a touch."""

JOINT = (0.0, 15.0, 30.0, 45.0, 60.0)


def run(data: Path | None) -> tuple[Report, ...]:
    """No recordings are needed: the twin is the truth."""
    del data
    static, moving = [], []
    for sheet in SHEETS:
        benches = [Bench(sheet, seed) for seed in SEEDS]
        static.append(_static_row(sheet, benches))
        moving.append(_moving_row(sheet, benches))
    return (
        Report(
            "touches on a bent sheet, textile-disc-16: median error, mm",
            ("sheet", "flat", "on 70 mm", "on 40 mm", "joint, own reference", "by its angle"),
            tuple(static),
            (
                f"references taken after wrapping (radii); joint: a strip of {1e3 * STRIP:.0f} mm, "
                f"references recorded at {', '.join(f'{a:.0f}' for a in JOINT)}°, touches between",
                f"seeds {', '.join(map(str, SEEDS))}, chosen on 1 to 3; {FRAMES} touches each",
            ),
        ),
        Report(
            f"while the sheet bends between 0 and {FARTHEST:.0f}° along that strip",
            (
                "sheet",
                "touch, mm, median",
                "95 %",
                "without taking bends out",
                "angle, °, median",
                "rms",
                "beside a touch, rms",
                "states right",
            ),
            tuple(moving),
            (
                "learnt from one recording of three bends and back, 36 frames",
                "states: idle, bend, touch and both, a bend from 3° on",
            ),
        ),
    )


def hinged(degrees: float) -> Pose:
    """Bent along the strip."""
    return (Bent(Hinge(math.radians(degrees), STRIP)),) if degrees else ()


@dataclass
class Found:
    """What was found while the sheet moved: m, rad."""

    places: list[float] = field(default_factory=list)
    plain: list[float] = field(default_factory=list)
    free: list[float] = field(default_factory=list)
    touched: list[float] = field(default_factory=list)
    right: list[bool] = field(default_factory=list)


class Bench:
    """One twin, and all that is measured on it; the sheet is never renewed."""

    def __init__(self, preset: str, seed: int) -> None:
        self.lab = Lab("textile-disc-16", preset, seed)
        self.random = np.random.default_rng(seed)
        self.lab.board.sheet.renew()
        self.flat = Reference.of(self.frames(IDLE))
        self.errors = {"flat": self.static(())}
        self.moving = self.moved(self.learnt())
        for millimetres in (70, 40):
            self.errors[f"{millimetres}"] = self.static((Bent(Cylinder(1e-3 * millimetres)),))
        self.errors["own"], self.errors["joint"] = self.jointed()

    def volts(self, presses: Sequence[Press] = (), pose: Pose = ()) -> FloatArray:
        """(n_meas,) V, one hold later."""
        lab = self.lab
        lab.board.sheet.set_presses(tuple(presses))
        lab.board.sheet.set_pose(pose)
        lab.time += HOLD
        samples = lab.board.sample(lab.table, lab.time)
        return lab.prepared.readout(Frame(0, 0, lab.time, 1, 0, 0, samples)).values

    def frames(self, count: int, pose: Pose = ()) -> FloatArray:
        """(count, n_meas) V that nothing touches."""
        return np.array([self.volts((), pose) for _ in range(count)])

    def finder(self, reference: Reference) -> Callable[[FloatArray, FloatArray], list[Reading]]:
        """What finds touches in V less the reference, beside directions that say nothing."""
        found = finding(self.lab.prepared, reference)
        image = self.lab.image
        return lambda dv, blind: found.push(View(image(dv), None, dv, blind))

    def static(self, pose: Pose) -> list[float]:
        """Errors of touches on a sheet that is held so, the reference taken there."""
        self.frames(3, pose)
        reference = Reference.of(self.frames(IDLE, pose))
        find, gain = self.finder(reference), reference.mean[:, None]
        found = []
        for _ in range(FRAMES // 2):
            press = drawn(self.random, 1)
            found.append(missed(find(self.volts(press, pose) - reference.mean, gain), press))
            self.volts((), pose)
        self.frames(3)
        return found

    def learnt(self) -> BendModel:
        """From one recording of known bends."""
        rows, angles, times = [], [], []
        for top, step in TURNS:
            way = np.arange(step, top + 1, step)
            for angle in [*way.tolist(), *way[-2::-1].tolist(), 0]:
                rows.append(self.volts((), hinged(angle)) - self.flat.mean)
                angles.append(math.radians(angle))
                times.append(self.lab.time)
        axis = np.full(len(rows), math.pi / 2)
        examples = BendExamples.of(np.array(rows), angles, axis, times)
        return BendModel.learn(examples, voltage_covariance(self.lab.prepared, self.flat))

    def moved(self, model: BendModel) -> Found:
        """Single touches and none while the sheet bends up and down."""
        out, gain = Found(), self.flat.mean[:, None]
        blind = np.hstack([gain, model.directions])
        find, plain = self.finder(self.flat), self.finder(self.flat)
        reader = BendReader(model, self.lab.prepared.spots.response)
        for k in range(FRAMES * 3 // 2):
            if k % 3 == 0:
                press = drawn(self.random, 1)
            angle = FARTHEST / 2 * (1 - math.cos(2 * math.pi * k / PERIOD))
            on = k % 6 in TOUCHED
            dv = self.volts(press if on else (), hinged(angle)) - self.flat.mean
            readings = find(dv, blind)
            told = reader.push(dv, readings, gain, self.lab.time)
            (out.touched if on else out.free).append(told.angle - math.radians(angle))
            if on:
                out.places.append(missed(readings, press))
                out.plain.append(missed(plain(dv, gain), press))
            if angle >= 3.0 or angle < 0.1:
                bent, both = angle >= 3.0, "bend and touch"
                wanted = (both if on else "bend") if bent else ("touch" if on else "idle")
                out.right.append(told.state == wanted)
        self.frames(3)
        return out

    def jointed(self) -> tuple[list[float], list[float]]:
        """Errors at angles between: by a reference of that angle, and by one interpolated."""
        course = [*JOINT, *JOINT[-2::-1]]
        angles = np.radians(np.repeat(course, 8))
        joint = JointReference.of(
            np.concatenate([self.frames(8, hinged(angle)) for angle in course]), angles
        )
        own, other = [], []
        for angle in (7.0, 22.0, 37.0, 52.0):
            pose = hinged(angle)
            self.frames(2, pose)
            there = Reference.of(self.frames(16, pose))
            told = joint.at(math.radians(angle))
            for _ in range(FRAMES // 6):
                press = drawn(self.random, 1)
                volts = self.volts(press, pose)
                for reference, errors in ((there, own), (told, other)):
                    find = self.finder(reference)
                    errors.append(
                        missed(find(volts - reference.mean, reference.mean[:, None]), press)
                    )
                self.volts((), pose)
        return own, other


def missed(readings: Sequence[Reading], press: Sequence[Press]) -> float:
    """M from the press to the strongest touch that was found; a radius of the skin where none."""
    if not readings:
        return 0.1
    return math.hypot(readings[0].x - press[0].x, readings[0].y - press[0].y)


def _static_row(sheet: str, benches: Sequence[Bench]) -> tuple[str, ...]:
    medians = [
        1e3 * float(np.median(np.concatenate([b.errors[key] for b in benches])))
        for key in ("flat", "70", "40", "own", "joint")
    ]
    return (f"{sheet}: {SHEETS[sheet]}", *(f"{value:.2f}" for value in medians))


def _moving_row(sheet: str, benches: Sequence[Bench]) -> tuple[str, ...]:
    def all_of(name: str) -> FloatArray:
        return np.concatenate([getattr(b.moving, name) for b in benches])

    places, plain = 1e3 * all_of("places"), 1e3 * all_of("plain")
    free, touched = np.degrees(all_of("free")), np.degrees(all_of("touched"))
    both = np.abs(np.concatenate([free, touched]))
    numbers = (
        np.median(places),
        np.percentile(places, 95),
        np.median(plain),
        np.median(both),
        np.sqrt(np.mean(both**2)),
        np.sqrt(np.mean(touched**2)),
    )
    right = 100 * float(np.mean(all_of("right")))
    return (sheet, *(f"{value:.2f}" for value in numbers), f"{right:.1f} %")
