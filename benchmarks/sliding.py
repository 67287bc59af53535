"""A finger that slides at 60 mm/s on the twin: how far behind it is reported, and by what."""

from __future__ import annotations

import tempfile
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from bench_rig import evenly, scan_time, stage
from report import Floats, Report, mm, progress, table
from tomoskin.core import Frame, Touch
from tomoskin.files.session import SessionReader
from tomoskin.files.session.session_reader import tick_rate
from tomoskin.pipeline import Pipeline, Prepared
from tomoskin.run import simulate
from tomoskin.sensing.track import SlideCorrection
from tomoskin.twin import Script

SEEDS = (11, 12, 13)
"""The lag and what tells that a finger slides were chosen on seeds 1 to 3."""

RUNS, ELECTRODES = 2, (16, 8)
SPEED, SECONDS, LEAST_WAY, WITHIN = 0.06, 3.0, 0.03, 0.07
LAGS = (0.0, 0.0055, 0.011, 0.022)
START, RAMP, LEAD = 0.5, 0.1, 3.0
STRAIGHT = 0.3
"""Seconds after a corner, or after the onset, that do not count as straight on."""

CASES = [(motion, preset) for motion in ("slides", "rolls") for preset in ("textile", "ideal")]


@dataclass(frozen=True)
class Way:
    """Corners of a finger's course, rows of s since its onset, x and y m, and its force N."""

    corners: Floats
    force: float

    @classmethod
    def drawn(cls, seed: int, number: int, seconds: float = SECONDS, within: float = WITHIN) -> Way:
        """From corner to corner at one speed, evenly ``within`` m of the middle of the skin."""
        random = np.random.default_rng((seed, number))
        force = float(random.uniform(2, 6))
        corners = [(0.0, *evenly(random, 1, within)[0])]
        while corners[-1][0] < seconds:
            x, y = evenly(random, 1, within)[0]
            time, *last = corners[-1]
            length = float(np.hypot(x - last[0], y - last[1]))
            if length > LEAST_WAY:
                corners.append((time + length / SPEED, x, y))
        return cls(np.array(corners), force)

    @property
    def end(self) -> float:
        """s since the onset."""
        return float(self.corners[-1, 0])

    def at(self, time: float) -> Floats:
        """(2,) m, ``time`` s after the onset."""
        t, x, y = self.corners.T
        return np.array([np.interp(time, t, x), np.interp(time, t, y)])

    def straight(self, time: float) -> bool:
        """Whether it has gone straight on for some time."""
        since = time - self.corners[:, 0]
        return bool(since[since >= 0].min() > STRAIGHT)

    def script(self, preset: str, motion: str) -> str:
        """Of the twin."""
        (_, x, y), *others = self.corners.tolist()
        rows = ", ".join(f'["{t:g} s", "{1e3 * x:g} mm", "{1e3 * y:g} mm"]' for t, x, y in others)
        return (
            f'format = 1\n[script]\nduration = "{START + self.end + 1:g} s"\n'
            f'lead_in = "{LEAD:g} s"\npreset = "{preset}"\n[[press]]\nid = "finger"\n'
            f'radius = "12 mm"\nat = ["{1e3 * x:g} mm", "{1e3 * y:g} mm"]\nstart = "{START:g} s"\n'
            f'rise = "{RAMP:g} s"\nfall = "{RAMP:g} s"\nhold = "{self.end:g} s"\n'
            f'force = "{self.force:g} N"\npath = [{rows}]\nmotion = "{motion}"\n'
        )


Seen = tuple[float, float, tuple[Touch, ...]]
"""A frame: device s, s of its middle since the onset, and its touches."""


def run() -> Iterator[Report]:
    rows = []
    for (motion, preset), electrodes in ((c, n) for c in CASES for n in ELECTRODES):
        progress(f"{motion}, {preset}, {electrodes} electrodes")
        runs = [
            (way, tuple(_seen(electrodes, preset, motion[:-1], way, seed)))
            for seed in SEEDS
            for way in (Way.drawn(seed, number) for number in range(RUNS))
        ]
        case = {"motion": motion, "sheet": preset, "electrodes": electrodes}
        rows += [case | _row(runs, lag) for lag in LAGS]
    yield table(
        "a finger that moves at 60 mm/s",
        rows,
        f"textile discs, 2 to 6 N, 12 mm radius, within {1e3 * WITHIN:.0f} mm of the "
        f"middle, from corner to corner; seeds {SEEDS}, {RUNS} runs each",
        "errors against the middle of the scan; straight on: from "
        f"{STRAIGHT:g} s after a corner on; behind: along the way, median, straight on",
        "ideal: without memory, drift and vices; rolls: friction of 0.02 in place of 0.3",
        across="slide_lag, mm",
    )


def _row(runs: Sequence[tuple[Way, Sequence[Seen]]], lag: float) -> dict[str, Any]:
    errors, straight, behind, second, frames, after = [], [], [], 0, 0, 0
    for way, seen in runs:
        slides = SlideCorrection(lag)
        for time, middle, touches in seen:
            slides = slides.after(touches, time)
            after += bool(touches) and middle > way.end + 2 * RAMP + STRAIGHT
            if not 0.1 + RAMP < middle < way.end:
                continue
            frames += 1
            second += len(touches) > 1
            true = way.at(middle)
            places = [slides.of_finger(t).detection for t in touches]
            off = [np.array([d.x, d.y]) - true for d in places]
            if not off:
                continue
            nearest = min(off, key=lambda error: float(np.hypot(*error)))
            errors.append(float(np.hypot(*nearest)))
            if way.straight(middle):
                heading = true - way.at(middle - 0.05)
                straight.append(errors[-1])
                behind.append(-float(nearest @ heading) / float(np.hypot(*heading)))
    median, p95 = mm(*np.percentile(errors, (50, 95)), digits=1)
    return {
        "frames": frames,
        "found": len(errors),
        "with a second touch": second,
        "lifted: frames with a touch": after,
        "slide_lag, mm": f"{1e3 * lag:g}",
        "median mm": median,
        "p95 mm": p95,
        "straight on: median mm": mm(np.median(straight), digits=1)[0],
        "behind, mm": mm(np.median(behind), digits=1)[0],
    }


def recorded(
    prepared: Prepared, way: Way, preset: str, motion: str, seed: int
) -> tuple[list[Frame], float]:
    """Frames of a session in which a finger goes a way, and ticks of a second."""
    with tempfile.TemporaryDirectory() as folder:
        path, script = Path(folder) / "run.mcap", Script.from_toml(way.script(preset, motion))
        simulate(script, prepared.skin, path, seed=seed, advance=lambda _, __: None)
        with SessionReader(path) as session:
            return [item.frame for item in session.frames()], tick_rate(session)


def _seen(electrodes: int, preset: str, motion: str, way: Way, seed: int) -> Iterator[Seen]:
    """What the live pipeline makes of it, by way of a session file."""
    prepared = stage(electrodes)
    frames, rate = recorded(prepared, way, preset, motion, seed)
    pipeline, scan = Pipeline(prepared), scan_time(prepared)
    pipeline.tick_rate = rate
    onset = frames[0].host_time - scan + LEAD + START  # a frame comes when its scan ends
    for frame in frames:
        if (result := pipeline.push(frame)) is not None:
            middle = frame.host_time - scan / 2 - onset
            yield frame.ticks / pipeline.tick_rate, middle, result.touches
