"""A program that is started again: does the reference of its last run hold, and show a press?"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np

from report import Report, progress
from tomoskin.board.source import ScanSettings
from tomoskin.core import FloatArray, Frame
from tomoskin.model.skin import Skin
from tomoskin.pipeline import FrameResult, Pipeline, Prepared, prepare
from tomoskin.run.board_memory import Trial
from tomoskin.twin import Press, TwinSettings, table_of
from tomoskin.twin.source import make_electronics

SKINS, SEEDS = ("textile-disc-8", "textile-disc-16"), range(11, 23)
"""Nothing here was chosen on them."""

PAUSES = ((60.0, 0.1), (600.0, 0.5), (3600.0, 3.0), (3600.0, -5.0))
"""Seconds between the runs, and K by which the sheet warms up meanwhile."""

KEPT, FRAMES, FORCE, SPREAD = 60, 60, 5.0, 0.05
VERDICTS = {True: "holds", False: "renewed", None: "touched"}
COLUMNS = (
    "skin",
    "pause, s",
    "warmer, K",
    "press",
    "holds",
    "touched",
    "renewed",
    "touches, at most",
    "error, mm",
)


def run(data: Path | None) -> tuple[Report, ...]:
    """Stop and start each twin; ``data`` is not needed."""
    del data
    rows = []
    for name in SKINS:
        prepared = prepare(Skin.load(name))
        for pause, warmer in PAUSES:
            for force in (0.0, FORCE):
                progress(f"{name}, {pause:g} s, {warmer:+g} K, {force:g} N")
                found = [_again(prepared, pause, warmer, force, seed) for seed in SEEDS]
                rows.append((name, pause, warmer, f"{force:g} N", *_judged(found)))
    note = f"preset textile, seeds {SEEDS[0]} to {SEEDS[-1]}; the press stands before the start"
    return (Report("started again after a pause", COLUMNS, tuple(rows), (note,)),)


Found = tuple[str, int, float]
"""Verdict, touches in the last frame, and mm from the press to the nearest of them."""


def _judged(found: list[Found]) -> tuple[object, ...]:
    verdicts = [verdict for verdict, _, _ in found]
    counts = (verdicts.count(verdict) for verdict in ("holds", "touched", "renewed"))
    errors = [error for _, _, error in found if np.isfinite(error)]
    error = f"{np.median(errors):.1f}" if errors else "–"
    return (*counts, max(touches for _, touches, _ in found), error)


def _again(prepared: Prepared, pause: float, warmer: float, force: float, seed: int) -> Found:
    place = np.random.default_rng(seed).uniform(-SPREAD, SPREAD, 2)
    trial, verdict, last = Trial(0.0), None, None
    for last in _restarted(prepared, pause, warmer, (place, force), seed):
        verdict = trial.push(last) if verdict is None else verdict
    assert last is not None
    errors = [
        1e3 * float(np.hypot(t.detection.x - place[0], t.detection.y - place[1]))
        for t in last.touches
        if force
    ]
    return VERDICTS[verdict], len(last.touches), min(errors, default=np.nan)


def _restarted(
    prepared: Prepared, pause: float, warmer: float, press: tuple[FloatArray, float], seed: int
) -> Iterator[FrameResult]:
    """Results of the second run, which begins with the last frames of the first."""
    board = make_electronics(prepared.skin, TwinSettings.preset("textile", seed))
    table = table_of(prepared.scan, ScanSettings.of(prepared.skin))
    rate, begun = prepared.skin.readout.tick_rate, KEPT * table.seconds + pause

    def frame(number: int, time: float) -> Frame:
        samples = board.sample(table, time)
        return Frame(number, round(number * table.seconds * rate), time, 0, 0, 0, samples)

    kept = [frame(k, k * table.seconds) for k in range(KEPT)]
    board.sheet.warm(warmer)
    (x, y), force = press
    if force:
        board.sheet.set_presses((Press(float(x), float(y), force=force, radius=0.012),))
    pipeline = Pipeline(prepared)
    for number, one in enumerate(kept):
        pipeline.push(replace(one, host_time=begun - 1e-3 * (KEPT - number)))
    for k in range(FRAMES):
        result = pipeline.push(frame(k, begun + k * table.seconds))
        if result is not None:
            yield result
