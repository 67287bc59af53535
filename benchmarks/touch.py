"""All that is promised of touch: the parts locator, touch_fit, tracking, states and health."""

from __future__ import annotations

import importlib
import multiprocessing
import os
import sys
import time
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

from threadpoolctl import threadpool_limits

from report import Report

CORES = 2
"""Parts that run at a time: the processor time in their tables is each part's own."""

PARTS = ("touch_fit", "tracking", "locator", "health", "states")
"""The longest first."""

Outcome = tuple[tuple[Report, ...], float]


def run(data: Path | None) -> tuple[Report, ...]:
    """The tables of all parts, each a benchmark by itself; one that fails stops no other."""
    return tuple(_all(data))


def _all(data: Path | None) -> Iterator[Report]:
    workers, context = len(os.sched_getaffinity(0)), multiprocessing.get_context("fork")
    took = []
    with ProcessPoolExecutor(min(workers, len(PARTS)), context) as pool:
        running = {name: pool.submit(_part, name, data) for name in PARTS}
        for name, part in running.items():
            reports, seconds = part.result()
            took.append((name, round(seconds / 60, 1)))
            yield from reports
    yield Report("minutes of each part", ("part", "minutes"), tuple(took))


def _part(name: str, data: Path | None) -> Outcome:
    start = time.perf_counter()
    sys.path.insert(0, str(Path(__file__).parent))
    try:
        with threadpool_limits(1):
            reports = tuple(importlib.import_module(name).run(data))
    except Exception as error:
        reports = (Report(f"{name} failed", ("why",), ((repr(error),),)),)
    return reports, time.perf_counter() - start
