"""Bends on the twin: touches on cylinders, while bending, by a joint's angle; angles and states."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from typing import Any

import numpy as np

from bench_rig import drawn, gap
from report import Floats, Report, mm, progress, rms, table
from tomoskin.core import Detection, Frame
from tomoskin.learning import BODY, BodyExamples, BodyModel, Differences, FrameView, JointReference
from tomoskin.model.mesh import Cylinder, Hinge
from tomoskin.pipeline import Pipeline, Prepared
from tomoskin.pipeline.finding import finder_of, voltage_covariance
from tomoskin.pipeline.frame_subspace import JUMP
from tomoskin.pipeline.pipeline import REFERENCE_FRAMES
from tomoskin.pipeline.rest import tuned_sheet
from tomoskin.sensing.signal import Reference
from tomoskin.twin import Bent, Pose, Press
from touch_lab import HOLD, TwinLab

SEEDS = (11, 12, 13)
SHEETS = {"ideal": "no memory, no hysteresis", "textile": "all of the textile preset"}
STRIP, FARTHEST = 0.06, 60.0
TURNS = ((60, 10), (30, 10), (45, 15))
"""Of the calibration: as far as so many degrees and back, in such steps."""

LEARNT = sum(2 * round(top / step) for top, step in TURNS)

IDLE, TOUCHES = 20, 24
REST = 300.0
"""Seconds that a sheet lies still before a reference is taken."""

STEP, PERIOD, MOVING = 0.1, 240, 480
"""Seconds between frames while it bends; frames of a bend there and back, and of the whole."""

ON, EVERY = 15, 30
"""Frames that a touch lasts, and from one to the next."""

SETTLED = 4
"""Frames from a touch's beginning or end to where it counts: the tracker takes three to be sure."""

PLAIN = 10
"""Of so many frames with a touch one is looked at without taking bends out too: what bends change
is then explained by as many touches as there may be, which takes long."""

JOINT = (0.0, 15.0, 30.0, 45.0, 60.0)
BETWEEN = (7.0, 22.0, 37.0, 52.0)
"""Degrees at which references were taken, and at which touches are looked for by them."""


def run() -> Iterator[Report]:
    benches = {f"{s}: {SHEETS[s]}": [Bench(s, seed) for seed in SEEDS] for s in SHEETS}
    yield table(
        "touches on a bent sheet, textile-disc-16: median error, mm",
        ({"sheet": sheet} | _static(some) for sheet, some in benches.items()),
        f"{REST / 60:.0f} minutes after wrapping (radii), a reference before each touch",
        f"joint: a strip of {1e3 * STRIP:.0f} mm, references recorded at "
        f"{', '.join(f'{a:.0f}' for a in JOINT)}°, up and down, touches between, the "
        "bends' directions taken out too",
        f"seeds {', '.join(map(str, SEEDS))}, chosen on 1 to 3; {TOUCHES} touches each",
    )
    yield table(
        f"while the sheet bends between 0 and {FARTHEST:.0f}° along that strip",
        ({"sheet": sheet} | _moving(some) for sheet, some in benches.items()),
        f"learnt from one recording of three bends and back, {LEARNT} frames, after one "
        f"bend and a rest; then {MOVING * STEP:.0f} s of frames, {1 / STEP:.0f}/s, through "
        f"the live pipeline, touched for {ON * STEP:g} of every {EVERY * STEP:g} s",
        "states: idle, bend, touch and both, a bend from 3° on; a radius where none is found",
    )


def way(top: int, step: int) -> list[int]:
    """Degrees: as far as ``top`` in such steps, and back."""
    there = list(range(step, top + 1, step))
    return [*there, *there[-2::-1], 0]


def hinged(degrees: float) -> Pose:
    """Bent along the strip."""
    return (Bent(Hinge(math.radians(degrees), STRIP)),) if degrees else ()


Moving = dict[str, list[float]]
"""While the sheet moved: m to ``places``, and to ``plain`` ones; rad by which angles are missed,
``free`` and ``touched``; whether states are ``right``."""


class Bench:
    """One twin, and all that is measured on it; the sheet is never renewed."""

    def __init__(self, preset: str, seed: int) -> None:
        progress(f"{preset}, seed {seed}")
        self.lab = TwinLab("textile-disc-16", preset, seed)
        self.random = np.random.default_rng(seed)
        self.lab.board.sheet.renew()
        self.errors = {"flat": self.static(())}
        for angle in way(60, 15):
            self.volts((), hinged(angle))
        self.flat = self.reference(())
        self.model = self.learnt()
        self.moving = self.moved()
        for millimetres in (70, 40):
            self.errors[f"{millimetres}"] = self.static((Bent(Cylinder(1e-3 * millimetres)),))
        self.errors["own"], self.errors["joint"] = self.jointed()

    def frame(self, presses: Sequence[Press], pose: Pose, after: float) -> Frame:
        """One frame ``after`` s more."""
        lab = self.lab
        lab.board.sheet.set_presses(tuple(presses))
        lab.board.sheet.set_pose(pose)
        lab.time += after
        return lab.rig.at(lab.time)

    def volts(self, presses: Sequence[Press] = (), pose: Pose = ()) -> Floats:
        """(n_meas,) V, one hold later."""
        return self.lab.prepared.readout(self.frame(presses, pose, HOLD)).values

    def frames(self, count: int, pose: Pose = ()) -> Floats:
        """(count, n_meas) V that nothing touches."""
        return np.array([self.volts((), pose) for _ in range(count)])

    def reference(self, pose: Pose) -> Reference:
        """Of a sheet that has been held so for a while."""
        self.frame((), pose, REST)
        return Reference.of(self.frames(IDLE, pose))

    def finder(
        self, reference: Reference, prepared: Prepared | None = None
    ) -> Callable[[Floats, Floats], list[Detection]]:
        """What finds touches in V less the reference, beside directions that say nothing.

        On the sheet of ``prepared``; by default it is the one that the reference shows, as a run
        finds it a second later.
        """
        found = finder_of(prepared or tuned_sheet(self.lab.prepared, reference), reference)
        image = self.lab.image
        n_meas = self.lab.prepared.pattern.n_meas
        none, excluded = np.zeros((n_meas, 0)), np.zeros(n_meas, bool)
        jumps = JUMP * reference.mean[:, None]

        def find(dv: Floats, blind: Floats) -> list[Detection]:
            differences = Differences(dv, blind, dv, blind, jumps, dv, none, dv, excluded)
            return found.push(FrameView(0.0, image(dv), None, differences))

        return find

    def static(self, pose: Pose) -> list[float]:
        """Errors of touches on a sheet that is held so, a reference taken before each of them."""
        sheet = tuned_sheet(self.lab.prepared, self.reference(pose))
        found = []
        for _ in range(TOUCHES):
            reference, press = Reference.of(self.frames(IDLE, pose)), drawn(self.random, 1)
            change = self.volts(press, pose) - reference.mean
            readings = self.finder(reference, sheet)(change, np.zeros((len(change), 0)))
            found.append(missed(readings, press))
            self.volts((), pose)
        return found

    def learnt(self) -> BodyModel:
        """From one recording of known bends."""
        rows, angles, times = [], [], []
        for top, step in TURNS:
            for angle in way(top, step):
                rows.append(self.volts((), hinged(angle)) - self.flat.mean)
                angles.append(math.radians(angle))
                times.append(self.lab.time)
        axis = np.full(len(rows), math.pi / 2)
        examples = BodyExamples.checked(np.array(rows), angles, axis, times)
        return BodyModel.learn(examples, voltage_covariance(self.lab.prepared, self.flat))

    def moved(self) -> Moving:
        """Single touches while the sheet bends up and down, as the live pipeline sees them."""
        bends = BODY.of(self.model, self.lab.prepared.pattern)
        pipeline = Pipeline(self.lab.prepared.calibrated(bends))
        out: Moving = {name: [] for name in ("places", "plain", "free", "touched", "right")}
        self.frame((), (), REST)
        for _ in range(REFERENCE_FRAMES):
            pipeline.push(self.frame((), (), STEP))
        plain, none = self.finder(self.flat), np.zeros((len(self.flat.mean), 0))
        for k in range(MOVING):
            if k % EVERY == 0:
                press = drawn(self.random, 1)
            angle = FARTHEST / 2 * (1 - math.cos(2 * math.pi * k / PERIOD))
            on, steady = k % EVERY < ON, k % ON >= SETTLED
            frame = self.frame(press if on else (), hinged(angle), STEP)
            result = pipeline.push(frame)
            if result is None or result.bend is None:
                raise AssertionError("every frame is read")
            told = result.bend
            out["touched" if on else "free"].append(told.angle - math.radians(angle))
            readings = [touch.detection for touch in result.touches]
            if on and steady:
                out["places"].append(missed(readings, press))
                if len(out["places"]) % PLAIN == 0:
                    change = result.voltages - result.reference
                    out["plain"].append(missed(plain(change, none), press))
            if steady and (angle >= 3.0 or angle < 0.1):
                bent, both = angle >= 3.0, "bend and touch"
                wanted = (both if on else "bend") if bent else ("touch" if on else "idle")
                out["right"].append(told.state == wanted)
        return out

    def jointed(self) -> tuple[list[float], list[float]]:
        """Errors at angles between: by a reference of that angle, and by one interpolated.

        All are taken before the first touch, so that what touches leave is in all of them alike.
        """
        course = [*JOINT, *JOINT[-2::-1]]
        joint = JointReference.of(
            np.concatenate([self.frames(8, hinged(angle)) for angle in course]),
            np.radians(np.repeat(course, 8)),
        )
        own = {angle: Reference.of(self.frames(16, hinged(angle))) for angle in BETWEEN}
        self.volts((), hinged(0.0))
        errors: tuple[list[float], list[float]] = [], []
        for angle, there in own.items():
            self.frames(2, hinged(angle))
            told = joint.at(math.radians(angle))
            ways = [(r, tuned_sheet(self.lab.prepared, r)) for r in (there, told)]
            for _ in range(TOUCHES // len(BETWEEN)):
                press = drawn(self.random, 1)
                volts = self.volts(press, hinged(angle))
                for (reference, sheet), found in zip(ways, errors, strict=True):
                    find = self.finder(reference, sheet)
                    blind = self.model.directions
                    found.append(missed(find(volts - reference.mean, blind), press))
                self.volts((), hinged(angle))
        return errors


def missed(readings: Sequence[Detection], press: Sequence[Press]) -> float:
    """M from the press to the strongest touch that was found; a radius of the skin where none."""
    return gap(readings[0], press[0]) if readings else 0.1


def _static(benches: Sequence[Bench]) -> dict[str, float]:
    columns = {"flat": "flat", "on 70 mm": "70", "on 40 mm": "40", "joint, own reference": "own",
               "by its angle": "joint"}  # fmt: skip
    errors = {name: [b.errors[key] for b in benches] for name, key in columns.items()}
    return {name: mm(np.median(np.concatenate(some)))[0] for name, some in errors.items()}


def _moving(benches: Sequence[Bench]) -> dict[str, Any]:
    def all_of(name: str) -> Floats:
        return np.concatenate([b.moving[name] for b in benches])

    places, free, touched = all_of("places"), all_of("free"), all_of("touched")
    both = np.degrees(np.abs(np.concatenate([free, touched])))
    return {
        "touch, mm, median": mm(np.median(places))[0],
        "95 %": mm(np.percentile(places, 95))[0],
        "without taking bends out": mm(np.median(all_of("plain")))[0],
        "angle, °, median": round(float(np.median(both)), 2),
        "rms": round(rms(both), 2),
        "beside a touch, rms": round(rms(np.degrees(touched)), 2),
        "states right": f"{100 * float(np.mean(all_of('right'))):.1f} %",
    }
