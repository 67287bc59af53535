"""Results of no source at any rate, the page's server before them, and Chromium: for page.py."""

from __future__ import annotations

import shutil
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from rig import served
from tomoskin.core import Detection, Image, Touch
from tomoskin.pipeline import FrameResult, Prepared
from tomoskin.run import Runner, Snapshot

_FLAGS = Path(__file__).resolve().parents[1] / "scripts" / "chromium.flags"
ARGUMENTS = tuple(_FLAGS.read_text(encoding="utf-8").split())
STEPS = 64
"""Pictures that are made beforehand and then shown in turn."""


class Stream(Runner):
    """Results as fast as asked: two touches that go round in noise."""

    def __init__(self, prepared: Prepared, rate: float) -> None:
        """``rate`` in results per second; nothing is opened."""
        super().__init__(prepared, _no_source)
        self._ending, self.made = threading.Event(), 0
        self._shown: Snapshot | None = None
        self._announces: list[Callable[[], None]] = []
        self._period = 1 / rate
        self._pictures = [_picture(prepared, step) for step in range(STEPS)]
        self._worker = threading.Thread(target=self._make, daemon=True)
        self._worker.start()

    @property
    def newest(self) -> Snapshot | None:
        """What was made last."""
        return self._shown

    @contextmanager
    def watch(self, announce: Callable[[], None]) -> Iterator[None]:
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
            picture = self._pictures[self.made % STEPS]
            self._shown = Snapshot(
                replace(picture, sequence=self.made, host_time=now), (), 1e-3, now
            )
            for announce in tuple(self._announces):
                announce()
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


def _no_source() -> Any:
    raise RuntimeError("a stream opens nothing")


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
