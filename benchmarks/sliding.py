"""A finger that slides at 60 mm/s on the twin: how far behind it is reported, and by what."""

from __future__ import annotations

import tempfile
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from report import Report, progress
from tomoskin.board.source import Configuration, ScanSettings
from tomoskin.core import Touch
from tomoskin.files.session import SessionReader, tick_rate
from tomoskin.model.skin import Skin
from tomoskin.pipeline import Pipeline, Prepared, prepare
from tomoskin.run import simulate
from tomoskin.sensing.track import SlideCorrection
from tomoskin.twin import Script

SEEDS = (11, 12, 13)
"""The lag and what tells that a finger slides were chosen on seeds 1 to 3."""

RUNS, ELECTRODES = 2, (16, 8)
SPEED, SECONDS, LEAST_WAY, WITHIN = 0.06, 3.0, 0.03, 0.07
LAG = 0.011
LAGS = (0.0, LAG / 2, LAG, 2 * LAG)
START, RAMP, LEAD = 0.5, 0.1, 3.0
STRAIGHT = 0.3
"""Seconds after a corner, or after the onset, that do not count as straight on."""

CASES = (
    ("slides", "textile"),
    ("slides", "ideal"),
    ("rolls", "textile"),
    ("rolls", "ideal"),
)

Floats = NDArray[np.float64]


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
        corners = [(0.0, *_somewhere(random, within))]
        while corners[-1][0] < seconds:
            x, y = _somewhere(random, within)
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


@dataclass(frozen=True)
class Seen:
    """A frame: device s, s of its middle since the onset, and its touches."""

    time: float
    middle: float
    touches: tuple[Touch, ...]


def run(data: Path | None) -> tuple[Report, ...]:
    """No recordings are needed: the twin is the truth."""
    del data
    rows = []
    for motion, preset in CASES:
        for electrodes in ELECTRODES:
            progress(f"{motion}, {preset}, {electrodes} electrodes")
            runs = [
                (way, tuple(_seen(electrodes, preset, motion[:-1], way, seed)))
                for seed in SEEDS
                for way in (Way.drawn(seed, number) for number in range(RUNS))
            ]
            rows += [(motion, preset, electrodes, *_row(runs, lag)) for lag in LAGS]
    return (
        Report(
            "a finger that moves at 60 mm/s",
            (
                *("motion", "sheet", "electrodes", "slide_lag, mm", "frames", "found"),
                *("with a second touch", "median mm", "p95 mm", "straight on: median mm"),
                *("behind, mm", "lifted: frames with a touch"),
            ),
            tuple(rows),
            (
                f"textile discs, 2 to 6 N, 12 mm radius, within {1e3 * WITHIN:.0f} mm of the "
                f"middle, from corner to corner; seeds {SEEDS}, {RUNS} runs each",
                "errors against the middle of the scan; straight on: from "
                f"{STRAIGHT:g} s after a corner on; behind: along the way, median, straight on",
                "sheet: textile, or ideal without memory, drift and vices of the board; rolls: "
                "friction of 0.02 in place of 0.3",
            ),
        ),
    )


def _row(runs: Sequence[tuple[Way, Sequence[Seen]]], lag: float) -> tuple[object, ...]:
    errors, straight, behind, second, frames, after = [], [], [], 0, 0, 0
    for way, seen in runs:
        slides = SlideCorrection(lag)
        for frame in seen:
            slides = slides.after(frame.touches, frame.time)
            after += bool(frame.touches) and frame.middle > way.end + 2 * RAMP + STRAIGHT
            if not 0.1 + RAMP < frame.middle < way.end:
                continue
            frames += 1
            second += len(frame.touches) > 1
            true = way.at(frame.middle)
            places = [slides.of_finger(t).detection for t in frame.touches]
            off = [np.array([d.x, d.y]) - true for d in places]
            if not off:
                continue
            nearest = min(off, key=lambda error: float(np.hypot(*error)))
            errors.append(float(np.hypot(*nearest)))
            if way.straight(frame.middle):
                heading = true - way.at(frame.middle - 0.05)
                straight.append(errors[-1])
                behind.append(-float(nearest @ heading) / float(np.hypot(*heading)))
    figures = (np.median(errors), np.percentile(errors, 95), np.median(straight), np.median(behind))
    return (
        f"{1e3 * lag:g}", frames, len(errors), second,
        *(f"{1e3 * value:.1f}" for value in figures), after,
    )  # fmt: skip


def _seen(electrodes: int, preset: str, motion: str, way: Way, seed: int) -> Iterator[Seen]:
    """What the live pipeline makes of it, by way of a session file."""
    prepared, scan_time = stage(electrodes)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "run.mcap"
        script = Script.from_toml(way.script(preset, motion))
        simulate(script, prepared.skin, path, seed=seed, advance=lambda _, __: None)
        with SessionReader(path) as session:
            pipeline, onset = Pipeline(prepared), None
            pipeline.tick_rate = tick_rate(session)
            for item in session.frames():
                host = item.frame.host_time
                if onset is None:  # a frame comes when its scan ends
                    onset = host - scan_time + LEAD + START
                if (result := pipeline.push(item.frame)) is not None:
                    time = item.frame.ticks / pipeline.tick_rate
                    yield Seen(time, host - scan_time / 2 - onset, result.touches)


@cache
def stage(electrodes: int) -> tuple[Prepared, float]:
    """What frames are seen by, and s that a scan takes."""
    prepared = prepare(Skin.load(f"textile-disc-{electrodes}"))
    return prepared, Configuration.of(prepared.scan, ScanSettings.of(prepared.skin)).scan_time


def _somewhere(random: np.random.Generator, within: float) -> tuple[float, float]:
    away, turn = within * np.sqrt(random.uniform()), random.uniform(0, 2 * np.pi)
    return float(away * np.cos(turn)), float(away * np.sin(turn))
