"""The page in Chromium: first picture, scripting, bundle, memory, many pages."""

from __future__ import annotations

import gzip
import shutil
import statistics
import threading
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

import numpy as np

from bench_rig import served
from report import Report
from tomoskin.core import Detection, Image, Touch
from tomoskin.model.skin import Skin
from tomoskin.pipeline import FrameResult, Prepared, prepare
from tomoskin.run import Runner, Snapshot
from tomoskin.server.server import STATIC

_FLAGS = Path(__file__).resolve().parents[1] / "scripts" / "chromium.flags"
ARGUMENTS = tuple(_FLAGS.read_text(encoding="utf-8").split())
STEPS = 64
"""Pictures that are made beforehand and then shown in turn."""


class Stream(Runner):
    """Results as fast as asked: two touches that go round in noise."""

    def __init__(self, prepared: Prepared, rate: float) -> None:
        """``rate`` in results per second; nothing is opened."""
        super().__init__(prepared, lambda: None)  # type: ignore[arg-type, return-value]
        self.flow.out.begin(prepared, "results made by no source")
        self._ending, self.made = threading.Event(), 0
        self._shown: Snapshot | None = None
        self._period = 1 / rate
        self._pictures = [_picture(prepared, step) for step in range(STEPS)]
        self._worker = threading.Thread(target=self._make, daemon=True)
        self._worker.start()

    @property
    def newest(self) -> Snapshot | None:
        """What was made last."""
        return self._shown

    def end(self) -> None:
        """Make no more."""
        self._ending.set()
        self._worker.join()

    def _make(self) -> None:
        due = time.monotonic()
        while not self._ending.is_set():
            now = time.monotonic()
            self.made += 1
            picture = self._pictures[self.made % STEPS]
            self._shown = Snapshot(
                replace(picture, sequence=self.made, host_time=now), (), 1e-3, now
            )
            self.audience.wake()
            due = max(due + self._period, now - 1)
            time.sleep(max(due - time.monotonic(), 0.0))


def _picture(prepared: Prepared, step: int) -> FrameResult:
    mesh, reference = prepared.mesh, prepared.operator.reference
    noise = np.random.default_rng(step % 16).standard_normal(len(mesh.cells))
    return FrameResult(
        sequence=0,
        host_time=0.0,
        ready=True,
        has_image=True,
        image=Image(1e-3 * noise, "S", mesh.identity),
        voltages=reference,
        reference=reference,
        touches=tuple(_touch(mesh.centroids, k, step) for k in range(2)),
        left_out=0,
    )


def _touch(places: np.ndarray, number: int, step: int) -> Touch:
    angle = 2 * np.pi * step / STEPS + 3 * number
    x, y = 0.05 * np.cos(angle), 0.05 * np.sin(angle)
    near = np.flatnonzero(np.hypot(*(places - (x, y)).T) < 0.02)
    reading = Detection(x, y, 1e-3, 2e-3, 1e-3, -0.1, near, cov_xy=1e-6)
    return Touch(id=number + 1, since=0.0, detection=reading, kind="decrease")


@contextmanager
def streaming(prepared: Prepared, rate: float) -> Iterator[tuple[Stream, str]]:
    """A stream and its page's address while the block lasts."""
    stream = Stream(prepared, rate)
    try:
        with served(stream) as policy:
            yield stream, policy.address
    finally:
        stream.end()


@contextmanager
def chromium() -> Iterator[Any]:
    """A browser that draws in software."""
    from playwright.sync_api import sync_playwright

    program = shutil.which("chromium") or shutil.which("google-chrome")
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=program, args=list(ARGUMENTS))
        yield browser
        browser.close()


@contextmanager
def opened(browser: Any, address: str) -> Iterator[Any]:
    """A page with nothing in any cache, when it has drawn its first picture."""
    with browser.new_context(viewport={"width": 1280, "height": 720}) as context:
        page = context.new_page()
        page.goto(address)
        page.wait_for_function("() => window.tomoskin?.ready")
        yield page


def heap(page: Any) -> float:
    """Bytes that the page's scripts hold after a collection."""
    devtools = page.context.new_cdp_session(page)
    for _ in range(2):
        devtools.send("HeapProfiler.collectGarbage")
    used = devtools.send("Runtime.getHeapUsage")["usedSize"]
    devtools.detach()
    return float(used)


_GARBAGE = 1e6
"""Bytes by which a heap differs between collections; a leak of 0.5 kB a frame is more."""

CORES = 2
"""A browser and a server: what every machine that shows a page has."""

CELLS = {3000: 2, 50_000: 6}
"""Triangles, and what scripting may cost a displayed frame, ms."""

RATE = 1000.0
OPENINGS, SECONDS, PAGES = 7, 6.0, 5
FILLED, WATCHED = 10.0, 40.0
BUSY = "() => { const end = performance.now() + 3000; while (performance.now() < end); }"
COUNT = "window.tomoskin.frames"
LOOK = "[window.tomoskin.frames, window.tomoskin.scripting, performance.now()]"
FLOOR = "performance.getEntriesByName('first-contentful-paint')[0]?.startTime"
Measurements = Iterator[tuple[str, Any, str]]


def run() -> Iterator[Report]:
    notes = (
        f"Results made by no source, {RATE:.0f}/s (for the first picture 100/s); Chromium draws in "
        "software (SwiftShader).",
        "Ready: from the navigation to the end of drawing the first picture, by the page's clock; "
        f"median and worst of {OPENINGS} with empty caches. Beside it a page of text of the same "
        "server in the same browser.",
        f"Memory: used heap after collection over {WATCHED:.0f} s, once all that the page keeps "
        "for ten seconds is there.",
    )
    yield Report("page", ("what", "measured", "promised"), tuple(_measured()), notes)


def _measured() -> Measurements:
    parts = (p for p in STATIC.rglob("*") if p.suffix in {".js", ".css", ".html", ".svg"})
    bundle = sum(len(gzip.compress(part.read_bytes())) for part in parts)
    yield "bundle, kB gzipped", round(bundle / 1e3, 1), "≤ 120"
    with chromium() as browser:
        for cells, most in CELLS.items():
            begun = time.process_time()
            skin = Skin.load("textile-disc-8").altered({"mesh": {"cells": cells}})
            prepared = prepare(skin)
            took = round(time.process_time() - begun, 1)
            yield f"prepared, s of processor, {cells}", took, ""
            yield from _ready(browser, prepared, cells)
            yield from _watched(browser, prepared, cells, most)
            if cells == min(CELLS):
                yield from _several(browser, prepared)


def _ready(browser: Any, prepared: Prepared, cells: int) -> Measurements:
    """The first picture, and the first sign of a page with nothing but text."""
    ready, floors = [], []
    with streaming(prepared, 100.0) as (_, address):
        for _ in range(OPENINGS):
            with opened(browser, address) as page:
                ready.append(page.evaluate("window.tomoskin.ready") / 1e3)
                page.goto(f"{urlsplit(address)._replace(path='/status').geturl()}")
                page.wait_for_function(f"() => {FLOOR}")
                floors.append(page.evaluate(FLOOR) / 1e3)
    promised = "< 1" if cells == min(CELLS) else ""
    yield f"ready, s, {cells} triangles: median", round(statistics.median(ready), 2), promised
    yield f"ready, s, {cells} triangles: worst", round(max(ready), 2), promised
    yield f"a page of text instead, s, {cells}: median", round(statistics.median(floors), 2), ""


def _watched(browser: Any, prepared: Prepared, cells: int, most: int) -> Measurements:
    with streaming(prepared, RATE) as (stream, address), opened(browser, address) as page:
        page.wait_for_timeout(3e3)
        frames, cost, then = page.evaluate(LOOK)
        page.wait_for_timeout(1e3 * SECONDS)
        frames2, cost2, now = page.evaluate(LOOK)
        shown = frames2 - frames
        page.wait_for_timeout(1e3 * FILLED)
        before, first = heap(page), page.evaluate(COUNT)
        page.wait_for_timeout(1e3 * WATCHED)
        grown, streamed = heap(page) - before, page.evaluate(COUNT) - first
        painted = {s.name: s for s in stream.flow.latency.stages()}["paint"]
    yield f"scripting per frame, ms, {cells}", round(1e3 * (cost2 - cost) / shown, 2), f"≤ {most}"
    pair = f"{1e3 * painted.p50:.1f}, {1e3 * painted.p99:.1f}"
    yield f"arrival to drawn, ms, {cells}: median, p99", pair, ""
    yield f"frames/s shown, {cells}", round(1e3 * shown / (now - then), 1), "≤ 60"
    gained = "none" if grown < _GARBAGE else round(grown / 1e3)
    yield f"memory gained over {streamed} frames, kB, {cells}", gained, "none"


def _several(browser: Any, prepared: Prepared) -> Measurements:
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
    yield f"results/s in, {PAGES} pages", round(results), f"{RATE:.0f}"
    yield f"frames/s on the slowest of {PAGES}", round(min(shown), 1), ""
    yield "the same after one was stalled for 3 s", round(min(stalled), 1), ""
    yield "results/s in beside a client that stops reading", round(still), f"{RATE:.0f}"
    yield "frames/s on the slowest page beside it", round(min(beside), 1), ""


def _shown(pages: list[Any], stream: Any) -> tuple[list[float], float]:
    """Frames/s that each page got in three seconds, and results/s that were made."""
    made, then = stream.made, time.monotonic()
    counts = [page.evaluate(COUNT) for page in pages]
    pages[0].wait_for_timeout(3e3)
    shown = [page.evaluate(COUNT) - c for page, c in zip(pages, counts, strict=True)]
    seconds = time.monotonic() - then
    return [count / seconds for count in shown], (stream.made - made) / seconds
