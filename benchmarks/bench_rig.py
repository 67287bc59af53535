"""What several benchmarks press, serve or load: a twin frame by frame, places, distances."""

from __future__ import annotations

import importlib
import sys
import threading
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from functools import cache
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
from scipy.optimize import linear_sum_assignment

from report import Floats
from tomoskin import Skin
from tomoskin.board.source import Configuration, ScanSettings
from tomoskin.core import Detection, Frame, Touch
from tomoskin.pipeline import FrameResult, Pipeline, Prepared, prepare
from tomoskin.run import Runner
from tomoskin.server import AccessPolicy, Hub, Server, application, listen
from tomoskin.server.settings_handlers import SettingsHandlers
from tomoskin.twin import (
    Faults,
    Press,
    SteppedSkin,
    TwinSettings,
)
from tomoskin.twin.source import Scans

INSIDE_90 = 4.605
"""Squared Mahalanobis distance within which nine of ten lie in a plane."""

NONE = Faults()
_EXAMPLES = Path(__file__).resolve().parents[1] / "examples"


class Rig:
    """Frames of the twin of ``skin`` with a preset and a seed, as fast as they are asked for."""

    def __init__(self, skin: Skin, preset: str, seed: int) -> None:
        self.skin, self._scans = skin, Scans(skin, TwinSettings.preset(preset, seed))
        self.board, self.table = self._scans.electronics, self._scans.table
        self.interval, self.number = self.table.seconds, 0

    def frame(self, presses: Iterable[Press] = (), faults: Faults = NONE) -> Frame:
        """The next scan."""
        self.board.sheet.set_presses(tuple(presses))
        self.board.set_faults(faults)
        frame = self.at(self.number * self.interval)
        self.number += 1
        return frame

    def at(self, time: float) -> Frame:
        """A frame of what presses now, at ``time`` s."""
        return self._scans.frame(self.number, time)

    def push(
        self, pipeline: Pipeline, count: int, presses: Iterable[Press] = (), faults: Faults = NONE
    ) -> list[FrameResult]:
        """What a pipeline makes of the next ``count`` frames."""
        results = [pipeline.push(self.frame(presses, faults)) for _ in range(count)]
        return [result for result in results if result is not None]


def held(
    twin: SteppedSkin, presses: Sequence[Press], seconds: float, ramp: float
) -> Iterator[tuple[Touch, ...]]:
    """Touches of each frame while presses come down within ``ramp`` s and then stand."""
    steps = max(round(ramp / twin.period), 1)
    for step in range(steps + round(seconds / twin.period)):
        part = min(1.0, (step + 1) / steps)
        yield twin.step(tuple(Press(p.x, p.y, part * p.force, p.radius) for p in presses)).touches


def evenly(random: np.random.Generator, count: int, reach: float) -> Floats:
    """(count, 2) m, evenly over a disc of radius ``reach``."""
    away, turn = reach * np.sqrt(random.uniform(size=count)), random.uniform(0, 2 * np.pi, count)
    return np.column_stack([away * np.cos(turn), away * np.sin(turn)])


def far_apart(places: Floats, apart: float) -> bool:
    """Whether no two places are nearer to each other than ``apart``."""
    gaps = np.linalg.norm(places[:, None] - places, axis=2)[np.triu_indices(len(places), 1)]
    return bool((gaps >= apart).all())


def drawn(
    random: np.random.Generator,
    count: int,
    *,
    reach: float = 0.085,
    apart: float = 0.045,
    radii: Sequence[float] = (8e-3, 10e-3, 12e-3, 15e-3),
    forces: tuple[float, float] = (2.0, 4.0),
) -> tuple[Press, ...]:
    """Presses at places drawn evenly, no two nearer than they may be."""
    while not far_apart(places := evenly(random, count, reach), apart):
        continue
    sizes, newtons = random.choice(radii, count), random.uniform(*forces, count)
    return tuple(
        Press(float(x), float(y), float(f), float(r))
        for (x, y), f, r in zip(places, newtons, sizes, strict=True)
    )


def gap(touch: Touch | Detection, place: Any) -> float:
    """Metres from a touch to a press or a point."""
    x, y = (place.x, place.y) if hasattr(place, "x") else place
    reading = touch.detection if isinstance(touch, Touch) else touch
    return float(np.hypot(reading.x - x, reading.y - y))


def nearest(touches: Iterable[Touch], place: Any) -> Touch | None:
    """The touch nearest to a place, if there is any."""
    return min(touches, key=lambda touch: gap(touch, place), default=None)


def matched(places: Floats, touches: Floats) -> list[tuple[int, int, float]]:
    """Numbers of a place and of its touch, and m between them, of (n, 2) and (k, 2) m."""
    apart = np.linalg.norm(places[:, None] - touches, axis=2)
    pairs = zip(*linear_sum_assignment(apart), strict=True)
    return [(int(one), int(other), float(apart[one, other])) for one, other in pairs]


def distance(detection: Detection, x: float, y: float) -> float:
    """Squared Mahalanobis distance of a point from a detection."""
    error = np.array([detection.x - x, detection.y - y])
    spread = [[detection.sd_x**2, detection.cov_xy], [detection.cov_xy, detection.sd_y**2]]
    return float(error @ np.linalg.solve(spread, error))


def scan_time(prepared: Prepared) -> float:
    """Seconds of a frame."""
    return Configuration.of(prepared.scan, ScanSettings.of(prepared.skin)).scan_time


@cache
def stage(electrodes: int) -> Prepared:
    """A textile disc, prepared."""
    return prepare(Skin.load(f"textile-disc-{electrodes}"))


def labelled_presses(skin: Skin, seed: int, count: int) -> tuple[Floats, Floats]:
    """(n, n_meas) V of single presses on the textile twin, and where they are, (n, 2) m."""
    from tomoskin.extras.labelled import COMMON_PRESSES, SetPlan, make_shard

    made = make_shard(SetPlan(skin.to_toml(), COMMON_PRESSES, "textile", seed, count), 0)
    return made["voltages"] - made["reference"], made["xy_m"]


@contextmanager
def served(runner: Runner) -> Iterator[AccessPolicy]:
    """Serve the page of ``runner`` on a free port; who may read it, with the port."""
    hub = Hub(runner)
    SettingsHandlers(hub)
    with listen("127.0.0.1", 0) as listener:
        policy = AccessPolicy(listener.getsockname()[1])
        server = Server.of(application(hub, policy))
        thread = threading.Thread(target=server.run_on, args=(listener,))
        thread.start()
        try:
            yield policy
        finally:
            server.stop()
            thread.join()


def load_example(name: str) -> ModuleType:
    """A module of the examples' folder; it may import its neighbours."""
    sys.path.insert(0, str(_EXAMPLES))
    try:
        return importlib.import_module(name)
    finally:
        sys.path.remove(str(_EXAMPLES))
