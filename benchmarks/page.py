"""The page in Chromium: first picture, scripting, bundle, memory, many pages, settings."""

from __future__ import annotations

import gzip
import statistics
import time
from contextlib import ExitStack
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

from threadpoolctl import threadpool_limits

from page_stream import chromium, heap, opened, streaming
from report import Report
from tomoskin.model.skin import Skin
from tomoskin.pipeline import Prepared, colour_limit, prepare
from tomoskin.server import STATIC

CORES = 2
"""A browser and a server: what every machine that shows a page has."""

CELLS = {3000: 2, 50_000: 6}
"""Triangles, and what scripting may cost a displayed frame, ms."""

RATE = 1000.0
OPENINGS = 7
SECONDS = 6.0
PAGES = 5
FILLED, WATCHED = 10.0, 40.0
REPEATS = 7
BUSY = "() => { const end = performance.now() + 3000; while (performance.now() < end); }"
COUNT = "window.tomoskin.frames"
LOOK = "[window.tomoskin.frames, window.tomoskin.scripting, performance.now()]"
FLOOR = "performance.getEntriesByName('first-contentful-paint')[0]?.startTime"
CHANGES: dict[str, dict[str, dict[str, Any]]] = {
    "alpha by hand": {"inverse": {"alpha": 0.05}},
    "threshold": {"touch": {"gamma1": 0.7}},
    "prior": {"inverse": {"prior": "laplace"}},
    "touch method fit": {"touch": {"method": "fit"}},
    "electrode width": {"electrodes": {"width": "12 mm"}},
    "mesh, 2500 triangles": {"mesh": {"cells": 2500}},
}
Rows = list[tuple[Any, ...]]


def run(data: Path | None) -> tuple[Report, ...]:
    """Measure on the loopback; ``data`` is not needed."""
    del data
    return _page(), _settings()


def _page() -> Report:
    rows: Rows = [("bundle, kB gzipped", _bundle(), "≤ 120")]
    with chromium() as browser:
        for cells, most in CELLS.items():
            begun = time.process_time()
            prepared = prepare(_skin(cells))
            rows += [
                (f"prepared, s of processor, {cells}", round(time.process_time() - begun, 1), "")
            ]
            rows += _ready(browser, prepared, cells)
            rows += _watched(browser, prepared, cells, most)
            if cells == min(CELLS):
                rows += _several(browser, prepared)
    notes = (
        f"Results made by no source, {RATE:.0f}/s (for the first picture 100/s); Chromium draws in "
        "software (SwiftShader).",
        "Ready: from the navigation to the end of drawing the first picture, by the page's clock; "
        f"median and worst of {OPENINGS} with empty caches. Beside it a page of text of the same "
        "server in the same browser.",
        "Scripting: arrival, decoding, marks, numbers and calls to WebGL, per displayed frame.",
        f"Memory: used heap after collection over {WATCHED:.0f} s, once all that the page keeps "
        "for ten seconds is there; an hour: tomoskin bench page_hour.",
    )
    return Report("page", ("what", "measured", "promised"), tuple(rows), notes)


def _skin(cells: int) -> Skin:
    return Skin.load("textile-disc-8").altered({"mesh": {"cells": cells}})


def _bundle() -> float:
    parts = (p for p in STATIC.rglob("*") if p.suffix in {".js", ".css", ".html", ".svg"})
    return round(sum(len(gzip.compress(part.read_bytes())) for part in parts) / 1e3, 1)


def _ready(browser: Any, prepared: Prepared, cells: int) -> Rows:
    """The first picture, and the first sign of a page with nothing but text."""
    found, floors = [], []
    with streaming(prepared, 100.0) as (_, address):
        for _ in range(OPENINGS):
            with opened(browser, address) as page:
                found.append(page.evaluate("window.tomoskin.ready") / 1e3)
                page.goto(f"{urlsplit(address)._replace(path='/status').geturl()}")
                page.wait_for_function(f"() => {FLOOR}")
                floors.append(page.evaluate(FLOOR) / 1e3)
    promised = "< 1" if cells == min(CELLS) else ""
    return [
        (f"ready, s, {cells} triangles: median", round(statistics.median(found), 2), promised),
        (f"ready, s, {cells} triangles: worst", round(max(found), 2), promised),
        (f"a page of text instead, s, {cells}: median", round(statistics.median(floors), 2), ""),
    ]


def _watched(browser: Any, prepared: Prepared, cells: int, most: int) -> Rows:
    with streaming(prepared, RATE) as (stream, address), opened(browser, address) as page:
        page.wait_for_timeout(3e3)
        frames, cost, then = page.evaluate(LOOK)
        page.wait_for_timeout(1e3 * SECONDS)
        frames2, cost2, now = page.evaluate(LOOK)
        seen = frames2 - frames
        page.wait_for_timeout(1e3 * FILLED)
        before, first = heap(page), page.evaluate(COUNT)
        page.wait_for_timeout(1e3 * WATCHED)
        grown, streamed = heap(page) - before, page.evaluate(COUNT) - first
        painted = {s.name: s for s in stream.latency.stages()}["paint"]
    return [
        (f"scripting per frame, ms, {cells}", round(1e3 * (cost2 - cost) / seen, 2), f"≤ {most}"),
        (f"arrival to drawn, ms, {cells}: median, p99", _pair(painted), ""),
        (f"frames/s shown, {cells}", round(1e3 * seen / (now - then), 1), "≤ 60"),
        (f"memory gained over {streamed} frames, kB, {cells}", round(grown / 1e3), "none"),
    ]


def _pair(stage: Any) -> str:
    return f"{1e3 * stage.p50:.1f}, {1e3 * stage.p99:.1f}"


def _several(browser: Any, prepared: Prepared) -> Rows:
    """Five pages, one of them stalled for three seconds; and a client that stops reading."""
    from websockets.sync.client import connect

    with streaming(prepared, RATE) as (stream, address), ExitStack() as stack:
        pages = [stack.enter_context(opened(browser, address)) for _ in range(PAGES)]
        shown, results = _shown(pages, stream)
        pages[0].evaluate(BUSY)
        stalled, _ = _shown(pages, stream)
        at = urlsplit(address)
        asleep = at._replace(scheme="ws", path="/ws").geturl()
        stack.enter_context(connect(asleep, origin=f"http://{at.netloc}", max_queue=1))
        beside, still = _shown(pages, stream)
    return [
        (f"results/s in, {PAGES} pages", round(results), f"{RATE:.0f}"),
        (f"frames/s on the slowest of {PAGES}", round(min(shown), 1), ""),
        ("the same after one was stalled for 3 s", round(min(stalled), 1), ""),
        ("results/s in beside a client that stops reading", round(still), f"{RATE:.0f}"),
        ("frames/s on the slowest page beside it", round(min(beside), 1), ""),
    ]


def _shown(pages: list[Any], stream: Any) -> tuple[list[float], float]:
    """Frames/s that each page got in three seconds, and results/s that were made."""
    made, then = stream.made, time.monotonic()
    counts = [page.evaluate(COUNT) for page in pages]
    pages[0].wait_for_timeout(3e3)
    shown = [page.evaluate(COUNT) - c for page, c in zip(pages, counts, strict=True)]
    seconds = time.monotonic() - then
    return [count / seconds for count in shown], (stream.made - made) / seconds


def _settings() -> Report:
    with threadpool_limits(1):  # as while a source runs
        rows = _changed(prepare(_skin(3000)))
    return Report(
        "page: settings made ready, ms, textile-disc-8 at 3,000 triangles",
        ("change", "median", "worst", "promised"),
        tuple(rows),
        ("The picture goes on meanwhile; the source is opened anew after the last two.",),
    )


def _changed(prepared: Prepared) -> Rows:
    rows: Rows = []
    for name, change in CHANGES.items():
        skin = prepared.skin.altered(change)
        times = []
        for _ in range(REPEATS):
            fresh = skin.altered({})
            start = time.perf_counter()
            made = prepare(fresh, prepared)
            colour_limit(made)
            times.append(1e3 * (time.perf_counter() - start))
        promised = "< 150" if name in ("alpha by hand", "threshold", "prior") else ""
        rows.append((name, round(statistics.median(times), 1), round(max(times), 1), promised))
    return rows
