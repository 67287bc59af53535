"""A skin on a body that moves, on the twin: false touches, touches found, the body's state."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from typing import Any

import numpy as np

from bench_rig import Rig, drawn, gap
from report import Floats, Report, mm, percent, progress, rms, table
from tomoskin import Skin
from tomoskin.core import Frame
from tomoskin.extras.body import BODY, BodyExamples, BodyModel, BodyReading
from tomoskin.model.mesh import Hinge
from tomoskin.pipeline import FrameResult, Pipeline, prepare
from tomoskin.pipeline.finding import voltage_covariance
from tomoskin.pipeline.pipeline import REFERENCE_FRAMES
from tomoskin.sensing.signal import Reference
from tomoskin.twin import Bent, Deformation, Press, Stretched

SEEDS = (9611, 9612)
BODIES = {"bends": 0.0, "bends and swells": 0.2}
"""A finger along x, and by how much its girth grows at most."""

STRIP, FARTHEST = 0.06, math.radians(90.0)
STEP, REST = 0.1, 60.0
"""Seconds between frames, and for which the body lies still before a reference."""

LEARNT, IDLE, TOUCHED = 600, 600, 240
"""Frames of the three motions of each body."""

ON, EVERY, SETTLED = 15, 30, 4
"""Frames that a touch lasts, from one to the next, and from its beginning or end to where it
counts: the tracker takes three to be sure."""

MOVED = math.radians(3.0), 0.01
"""From there on it is called a bend."""


def run() -> Iterator[Report]:
    yield table(
        "a body that moves at random, textile twin, 16 electrodes",
        [_row(name, [Body(name, seed) for seed in SEEDS]) for name in BODIES],
        f"learnt from {LEARNT * STEP:.0f} s of random motion with encoder values; then "
        f"{IDLE * STEP:.0f} s without a touch, {TOUCHED * STEP:.0f} s with one for "
        f"{ON * STEP:g} of every {EVERY * STEP:g} s, {1 / STEP:.0f} frames/s, live pipeline",
        "bends 0 to 90° over 60 mm; the girth grows by 0 to 20 %; gain 15 (35 would saturate)",
        f"seeds {', '.join(map(str, SEEDS))}, new to the method; intervals are of 90 %",
        "states: idle, bend, touch and both; a bend from 3° or 1 % on",
    )


Followed = list[tuple[Floats, Press | None, FrameResult]]
"""States, presses and results."""


class Body:
    """One twin of a body, and what the live pipeline says of its motions."""

    def __init__(self, name: str, seed: int) -> None:
        progress(f"{name}, seed {seed}")
        self.swell = BODIES[name]
        self.rig = Rig(_skin(), "textile", seed)
        self.prepared, self.time = prepare(self.rig.skin), 0.0
        self.random = np.random.default_rng(seed)
        self.frames([(f * FARTHEST, f * self.swell) for f in (*UP, *UP[::-1])])
        states, times, volts, rest = self.motion(LEARNT)
        kept = 2 if self.swell else 1
        examples = BodyExamples.checked(
            volts - rest.mean, times, state=states[:, :kept], names=("angle", "stretch")[:kept]
        )
        model = BodyModel.learn(examples, voltage_covariance(self.prepared, rest))
        self.prepared = self.prepared.calibrated(BODY.of(model, self.prepared.pattern))
        self.idle = self.followed(IDLE, touched=False)
        self.touched = self.followed(TOUCHED, touched=True)

    def frame(
        self, state: Sequence[float] | Floats, press: Sequence[Press] = (), after: float = STEP
    ) -> Frame:
        """A frame of the body at a state."""
        angle, swell = state
        pose: list[Deformation] = [Bent(Hinge(angle, STRIP))] if angle else []
        pose += [Stretched(swell, axis=math.pi / 2)] if swell else []
        sheet = self.rig.board.sheet
        sheet.set_presses(tuple(press))
        sheet.set_pose(tuple(pose))
        self.time += after
        self.rig.number += 1
        return self.rig.at(self.time)

    def frames(self, states: Iterable[Sequence[float] | Floats]) -> Floats:
        """(n, n_meas) V."""
        readout = self.prepared.readout
        volts: Floats = np.array([readout(self.frame(state)).values for state in states])
        return volts

    def course(self, n: int) -> Floats:
        """(n, 2) random angles and elongations, from rest."""
        parts = np.column_stack([_course(self.random, n), _course(self.random, n)])
        return np.asarray(parts * np.array([FARTHEST, self.swell]), np.float64)

    def motion(self, n: int) -> tuple[Floats, Floats, Floats, Reference]:
        """States, times, volts of a motion, and the reference before it."""
        self.frame((0, 0), after=REST)
        rest = Reference.of(self.frames([(0, 0)] * REFERENCE_FRAMES))
        states = self.course(n)
        times = self.time + STEP * np.arange(1.0, n + 1)
        volts = self.frames(states)
        self.frames([f * states[-1] for f in UP[::-1]])
        return states, times, volts, rest

    def followed(self, n: int, *, touched: bool) -> Followed:
        """States, presses and results, without frames in which a touch begins or ends."""
        pipeline, press = Pipeline(self.prepared), drawn(self.random, 1)
        out: Followed = []
        self.frame((0, 0), after=REST)
        for _ in range(REFERENCE_FRAMES):
            pipeline.push(self.frame((0, 0)))
        states = self.course(n)
        for k, state in enumerate(states):
            on = touched and k % EVERY < ON
            if touched and k % EVERY == 0:
                press = drawn(self.random, 1)
            result = pipeline.push(self.frame(state, press if on else ()))
            if result is not None and (k % ON >= SETTLED or not touched):
                out.append((state, press[0] if on else None, result))
        self.frames([f * states[-1] for f in UP[::-1]])
        return out


UP = np.linspace(0, 1, 20)


def _course(random: np.random.Generator, n: int) -> Floats:
    """(n,) from 0: smoothly to drawn values, each within 2.4 to 8 s; some stay for a while."""
    out: list[float] = []
    now = 0.0
    while len(out) < n:
        goal = random.uniform() if random.uniform() > 0.15 else random.choice([0.0, 1.0])
        steps = round(random.uniform(2.4, 8.0) / STEP)
        part = (1 - np.cos(np.pi * np.arange(1, steps + 1) / steps)) / 2
        out += list(now + (goal - now) * part)
        now = float(goal)
        out += [now] * round(max(random.uniform(-4.0, 2.0), 0.0) / STEP)
    return np.array(out[:n])


def _skin() -> Skin:
    return Skin.load("textile-disc-16").altered({"readout": {"gain": 15}})


def _reading(result: FrameResult) -> BodyReading:
    if "body" not in result.readings:
        raise AssertionError("every frame is read")
    reading: BodyReading = result.readings["body"]
    return reading


def _row(name: str, bodies: Sequence[Body]) -> dict[str, Any]:
    idle = [one for body in bodies for one in body.idle]
    touched = [one for body in bodies for one in body.touched]
    false = [len({t.id for _, _, r in body.idle for t in r.touches}) for body in bodies]
    on = [(press, result.touches) for _, press, result in touched if press is not None]
    off = [gap(touches[0], press) for press, touches in on if touches]
    every = [(state, press, _reading(result)) for state, press, result in idle + touched]
    wrong = np.array([r.values - state[: len(r.values)] for state, _, r in every])
    inside = np.abs(wrong) < 1.645 * np.array([r.deviations for *_, r in every])
    right = [r.state == _state(state, press) for state, press, r in every]
    row: dict[str, Any] = {
        "body": name,
        "untouched frames": len(idle),
        "false touches": sum(false),
        "touched frames": len(on),
        "found": percent([bool(touches) for _, touches in on]),
        "several found": percent([len(touches) > 1 for _, touches in on]),
        "error, mm, median": mm(np.median(off))[0],
        "95 %": mm(np.percentile(off, 95))[0],
        "angle, °, rms": round(math.degrees(rms(wrong[:, 0])), 2),
        "in the interval": percent(inside[:, 0]),
        "states right": f"{100 * float(np.mean(right)):.1f} %",
    }
    if wrong.shape[1] > 1:
        row |= {"stretch, %, rms": round(100 * rms(wrong[:, 1]), 2)}
        row |= {"stretch in the interval": percent(inside[:, 1])}
    return row


def _state(state: Floats, press: Press | None) -> str:
    bent = bool((state >= MOVED).any())
    if press is None:
        return "bend" if bent else "idle"
    return "bend and touch" if bent else "touch"
