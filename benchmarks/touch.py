"""All that is promised of touch: locator, fit, tracking, two fingers, classes and health."""

from __future__ import annotations

import importlib
import multiprocessing
import os
import sys
import time
from collections.abc import Iterator
from pathlib import Path

from threadpoolctl import threadpool_limits

from report import Report

CORES = 2
"""Parts that run at a time: the processor time in their tables is each part's own."""

PARTS = ("touch_fit", "locator", "tracking_plant", "two_fingers", "health", "classes")
LIMIT = 11.5 * 60
"""Seconds after which parts that still run are ended: each is a benchmark by itself."""

Outcome = tuple[tuple[Report, ...], float]


def run(data: Path | None) -> tuple[Report, ...]:
    """The tables of all parts. One that fails, or is not done in time, stops no other."""
    return tuple(_all(data))


def _all(data: Path | None) -> Iterator[Report]:
    workers, end = len(os.sched_getaffinity(0)), time.monotonic() + LIMIT
    took: list[tuple[object, ...]] = []
    with multiprocessing.get_context("fork").Pool(workers) as pool:  # its end ends what still runs
        running = {name: pool.apply_async(_part, (name, data)) for name in PARTS}
        for name, part in running.items():
            try:
                reports, seconds = part.get(max(end - time.monotonic(), 0.0))
            except multiprocessing.TimeoutError:
                took.append((name, f"not done: tomoskin bench {name}"))
                continue
            took.append((name, round(seconds / 60, 1)))
            yield from reports
    notes = (f"ended after {LIMIT / 60:g} minutes, {workers} parts at a time",)
    yield Report("minutes of each part", ("part", "minutes"), tuple(took), notes)


def _part(name: str, data: Path | None) -> Outcome:
    start = time.perf_counter()
    sys.path.insert(0, str(Path(__file__).parent))
    try:
        with threadpool_limits(1):
            reports = tuple(importlib.import_module(name).run(data))
    except Exception as error:
        reports = (Report(f"{name} failed", ("why",), ((repr(error),),)),)
    return reports, time.perf_counter() - start
