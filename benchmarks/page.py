"""The page in Chromium: scripting per frame, start, bundle, memory, and settings made ready."""

from __future__ import annotations

import gzip
import shutil
import statistics
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from report import Report
from tomoskin.core import Image, Reading, Touch
from tomoskin.live import (
    STATIC,
    Door,
    Hub,
    Prepared,
    Result,
    Runner,
    Server,
    SettingsDesk,
    Snapshot,
    application,
    colour_limit,
    listen,
    prepare,
    prepare_again,
)
from tomoskin.skin import Skin

CELLS = (3000,)
RATE = 1000.0
SECONDS = 6.0
PAGES = 5
WATCHED = 15.0
REPEATS = 7
ARGUMENTS = (
    "--no-sandbox",
    "--disable-gpu",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    "--disable-quic",
    "--enable-precise-memory-info",
    "--js-flags=--expose-gc",
)
BUSY = "() => { const end = performance.now() + 3000; while (performance.now() < end); }"
COUNT = "window.tomoskin.frames"
CHANGES: dict[str, dict[str, dict[str, Any]]] = {
    "alpha by hand": {"inverse": {"alpha": 0.05}},
    "threshold": {"touch": {"gamma1": 0.7}},
    "prior": {"inverse": {"prior": "laplace"}},
    "touch method fit": {"touch": {"method": "fit"}},
    "electrode width": {"electrodes": {"width": "12 mm"}},
    "mesh, 2500 triangles": {"mesh": {"cells": 2500}},
}


def run(data: Path | None) -> tuple[Report, ...]:
    """Measure on the loopback; ``data`` is not needed."""
    del data
    return _page(), _settings()


class Stream(Runner):
    """Results of no source, as fast as asked: two touches that go round."""

    def __init__(self, prepared: Prepared) -> None:
        """Nothing is opened."""
        super().__init__(prepared, _no_source)
        self._ending, self.made = threading.Event(), 0
        self._shown: Snapshot | None = None
        self._announces: list[Callable[[], None]] = []
        random = np.random.default_rng(1)
        mesh, reference = prepared.mesh, prepared.operator.reference
        self._images = 1e-3 * random.standard_normal((16, len(mesh.cells)))
        self._place = mesh.centroids
        self._result = Result(
            sequence=0,
            host_time=0.0,
            ready=True,
            pictured=True,
            image=Image(self._images[0], "S", mesh.identity),
            voltages=reference,
            reference=reference,
            touches=(),
            left_out=0,
        )
        self._worker = threading.Thread(target=self._make, daemon=True)
        self._worker.start()

    source = "a bench"

    @property
    def newest(self) -> Snapshot | None:
        """What was made last."""
        return self._shown

    @contextmanager
    def watched_by(self, announce: Callable[[], None]) -> Iterator[None]:
        """Call it at each result."""
        self._announces.append(announce)
        yield
        self._announces.remove(announce)

    def end(self) -> None:
        """Make no more."""
        self._ending.set()
        self._worker.join()

    def _make(self) -> None:
        due = time.monotonic()
        while not self._ending.is_set():
            now = time.monotonic()
            self.made += 1
            self._shown = Snapshot(self._next(now), (), 1e-3, now)
            for announce in tuple(self._announces):
                announce()
            due += 1 / RATE
            time.sleep(max(due - time.monotonic(), 0.0))

    def _next(self, now: float) -> Result:
        image = replace(self._result.image, values=self._images[self.made % 16])
        touches = tuple(self._touch(k, now) for k in range(2))
        return replace(
            self._result, sequence=self.made, host_time=now, image=image, touches=touches
        )

    def _touch(self, number: int, now: float) -> Touch:
        angle = now + 3 * number
        x, y = 0.05 * np.cos(angle), 0.05 * np.sin(angle)
        near = np.flatnonzero(np.hypot(*(self._place - (x, y)).T) < 0.02)
        reading = Reading(x, y, 1e-3, 2e-3, 1e-3, -0.1, near, cov_xy=1e-6)
        return Touch(id=number + 1, since=0.0, reading=reading, kind="decrease")


def _no_source() -> Any:
    raise RuntimeError("a stream opens nothing")


@contextmanager
def _served(runner: Runner) -> Iterator[str]:
    hub = Hub(runner, limit=colour_limit(runner.prepared))
    hub.take(SettingsDesk(hub))
    with listen("127.0.0.1", 0) as listener:
        door = Door(listener.getsockname()[1])
        server = Server.of(application(hub, door))
        thread = threading.Thread(target=server.run_on, args=(listener,))
        thread.start()
        try:
            yield door.address
        finally:
            server.stop()
            thread.join()


def _page() -> Report:
    from playwright.sync_api import sync_playwright

    program = shutil.which("chromium") or shutil.which("google-chrome")
    rows: list[tuple[Any, ...]] = [("bundle, kB gzipped", _bundle(), "≤ 120")]
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=program, args=list(ARGUMENTS))
        for cells, most in zip(CELLS, (2,), strict=True):
            stream = Stream(
                prepare(Skin.load("textile-disc-8").altered({"mesh": {"cells": cells}}))
            )
            with _served(stream) as address:
                rows += _watched(browser, address, cells, most)
                if cells == CELLS[0]:
                    rows += _several(browser, address, stream)
            stream.end()
        browser.close()
    notes = (
        f"{RATE:.0f} results/s in, made by no source; Chromium draws in software (SwiftShader).",
        "Scripting: arrival, decoding, marks, numbers and calls to WebGL, per displayed frame.",
        f"Memory: used heap after collection, from the seventh second on, over {WATCHED:.0f} s.",
    )
    return Report("page", ("what", "measured", "promised"), tuple(rows), notes)


def _bundle() -> float:
    parts = (p for p in STATIC.rglob("*") if p.suffix in {".js", ".css", ".html", ".svg"})
    return round(sum(len(gzip.compress(part.read_bytes())) for part in parts) / 1e3, 1)


def _watched(browser: Any, address: str, cells: int, most: int) -> list[tuple[Any, ...]]:
    page = browser.new_page(viewport={"width": 1280, "height": 720})
    start = time.monotonic()
    page.goto(address)
    page.wait_for_function("() => window.tomoskin?.last")
    ready = time.monotonic() - start
    page.wait_for_timeout(1e3)
    look = "[window.tomoskin.frames, window.tomoskin.scripting, performance.now()]"
    frames, cost, then = page.evaluate(look)
    page.wait_for_timeout(1e3 * SECONDS)
    frames2, cost2, now = page.evaluate(look)
    seen = frames2 - frames
    heap = "() => { gc(); return performance.memory.usedJSHeapSize; }"
    before, first = page.evaluate(heap), frames2
    page.wait_for_timeout(1e3 * WATCHED)
    grown = page.evaluate(heap) - before
    streamed = page.evaluate(COUNT) - first
    page.close()
    return [
        (f"ready, s, {cells} triangles", round(ready, 2), "< 1" if most == 2 else ""),
        (f"scripting per frame, ms, {cells}", round(1e3 * (cost2 - cost) / seen, 2), f"≤ {most}"),
        (f"frames/s shown, {cells}", round(1e3 * seen / (now - then), 1), ""),
        (f"memory gained over {streamed} frames, kB, {cells}", round(grown / 1e3), "≤ 0"),
    ]


def _several(browser: Any, address: str, stream: Stream) -> list[tuple[Any, ...]]:
    """Five pages, and one that stops reading; the maker of results is not slowed."""
    pages = [browser.new_page() for _ in range(PAGES)]
    for page in pages:
        page.goto(address)
        page.wait_for_function("() => window.tomoskin?.last")
    pages[0].evaluate(
        "() => { const end = performance.now() + 3000; while (performance.now() < end); }"
    )
    made, then = stream.made, time.monotonic()
    counts = [page.evaluate(COUNT) for page in pages]
    pages[0].wait_for_timeout(3e3)
    shown = [page.evaluate(COUNT) - c for page, c in zip(pages, counts, strict=True)]
    seconds = time.monotonic() - then
    for page in pages:
        page.close()
    return [
        (f"results/s in, {PAGES} pages", round((stream.made - made) / seconds), f"{RATE:.0f}"),
        (f"frames/s on the slowest of {PAGES}", round(min(shown) / seconds, 1), ""),
    ]


def _settings() -> Report:
    prepared = prepare(Skin.load("textile-disc-8").altered({"mesh": {"cells": 3000}}))
    rows = []
    for name, change in CHANGES.items():
        skin = prepared.skin.altered(change)
        times = []
        for _ in range(REPEATS):
            fresh = skin.altered({})
            start = time.perf_counter()
            made = prepare_again(prepared, fresh)
            colour_limit(made)
            times.append(1e3 * (time.perf_counter() - start))
        promised = "< 150" if name in ("alpha by hand", "threshold", "prior") else ""
        rows.append((name, round(statistics.median(times), 1), round(max(times), 1), promised))
    return Report(
        "page: settings made ready, ms, textile-disc-8 at 3,000 triangles",
        ("change", "median", "worst", "promised"),
        tuple(rows),
        ("The picture goes on meanwhile; the source is opened anew after the last two.",),
    )
