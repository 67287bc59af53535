"""An hour of streaming to one page, compressed: heap of the page and memory of the server."""

from __future__ import annotations

import os
import time
from pathlib import Path
from typing import Any

import numpy as np

import tomoskin.server.page_connection
from page_stream import chromium, heap, opened, streaming
from report import Report
from tomoskin.model.skin import Skin
from tomoskin.pipeline import prepare

CORES = 2
MINUTES = 10.0
EVERY = 30.0
SETTLED = 60.0
"""Seconds during which code is compiled and buffers of ten seconds fill; not counted."""

RATE = 1000.0
PERIOD = 1 / 240
"""Between frames to the page, s: four times as many as it may get as a rule."""

HOUR = 3600 * 60
"""Frames that a page shows in an hour at most."""


def run(data: Path | None, minutes: float = MINUTES) -> tuple[Report, ...]:
    """Measure on the loopback; ``data`` is not needed."""
    del data
    tomoskin.server.page_connection.FRAME_PERIOD = PERIOD
    prepared = prepare(Skin.load("textile-disc-8").altered({"mesh": {"cells": 3000}}))
    with (
        chromium() as browser,
        streaming(prepared, RATE) as (stream, address),
        opened(browser, address) as page,
    ):
        page.wait_for_timeout(1e3 * SETTLED)
        looks = [_look(page, stream)]
        end = time.monotonic() + 60 * minutes - SETTLED
        while time.monotonic() < end:
            page.wait_for_timeout(1e3 * EVERY)
            looks.append(_look(page, stream))
    return (_report(np.array(looks), minutes),)


def _look(page: Any, stream: Any) -> tuple[float, float, float, float]:
    """Frames at the page, results made, heap and resident memory of the server, MB."""
    resident = int(Path("/proc/self/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE")
    return page.evaluate("window.tomoskin.frames"), stream.made, heap(page) / 1e6, resident / 1e6


def _report(looks: np.ndarray, minutes: float) -> Report:
    frames = looks[:, 0] - looks[0, 0]
    rows = [
        ("frames to the page", f"{frames[-1]:.0f}", f"{100 * frames[-1] / HOUR:.0f} % of an hour"),
        ("results made", f"{looks[-1, 1] - looks[0, 1]:.0f}", ""),
        *_grown("heap of the page", frames, looks[:, 2]),
        *_grown("memory of the server", frames, looks[:, 3]),
    ]
    notes = (
        f"{minutes:g} minutes, {RATE:.0f} results/s in, up to {1 / PERIOD:.0f} frames/s to the "
        f"page; looked at every {EVERY:.0f} s, the heap after collection; the first "
        f"{SETTLED:.0f} s are left out.",
        "Growth: slope of a straight line over all looks, per 216,000 frames: an hour at 60/s.",
    )
    return Report("page, an hour", ("what", "measured", ""), tuple(rows), notes)


def _grown(what: str, frames: np.ndarray, held: np.ndarray) -> list[tuple[str, str, str]]:
    slope, _ = np.polyfit(frames, held, 1)
    spread = float(np.ptp(held))
    return [
        (
            f"{what}, MB: first, last",
            f"{held[0]:.2f}, {held[-1]:.2f}",
            f"between looks ± {spread:.2f}",
        ),
        (f"{what}, MB grown in an hour", f"{slope * HOUR:.2f}", ""),
    ]
