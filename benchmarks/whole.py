"""All of it in one table, beside plain scipy and pyEIT in the same run; two to three minutes."""

from __future__ import annotations

import os
import resource
import shutil
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import scipy.linalg
from scipy.interpolate import RBFInterpolator

import frame
import page
import twin
from bench_rig import labelled_presses
from forward import ALPHA, PATTERN, disc, measure_touch, set_up
from forward_others import INSTALLED, Peer, Script
from report import Report, cell, clock, medians, progress
from tomoskin import ForwardModel, Locator, Skin
from tomoskin.board.wire import encode
from tomoskin.core import Capacity, FloatArray, Frame, Mark, MarkedFrame, Worker
from tomoskin.files.session import RawRead, Recorder, SessionReader, SessionWriter
from tomoskin.model.pattern import Scan
from tomoskin.pipeline import prepare
from tomoskin.server.server import STATIC

CELLS, SECONDS = 3000, 8.0
REPEATS = 5
"""Starts of each program."""

RECORDED, WARM, SOUGHT = 10, 2000, 600
"""Seconds recorded at their own pace, frames before what counts, s of the session sought in."""

SKIN, LEARNT, TESTED = "textile-disc-16", 200, 200
SMOOTHING = 1.0
"""Of the radial basis functions, on rows of unit deviation; 0.1 and 10 are no better."""

MODEL = {
    "forward": "voltages of a new conductivity",
    "jacobian": "Jacobian with its solves",
    "set-up": "mesh to one-step operator (NOSER)",
    "picture": "picture of a frame's voltages",
}


@dataclass(frozen=True)
class Line:
    """What was measured here, what was promised of it, and what others take for the same."""

    what: str
    unit: str
    value: float | str | None
    promised: str = ""
    scipy: float | None = None
    peer: float | None = None


def run() -> Iterator[Report]:
    parts = (_start, _forward, _frame, _touch, _twin, _wire, _session, _page)
    rows = []
    for number, lines in enumerate(parts, start=1):
        part = lines.__name__.removeprefix("_")
        progress(f"{part} ({number} of {len(parts)})")
        rows += [_row(part, line) for line in lines()]
    columns = ("part", "what", "measured", "promised", "plain scipy", "×", "pyEIT", "×")
    notes = (
        f"16 electrodes, adjacent, {CELLS:,} triangles unless said otherwise; medians of "
        f"{clock()[1]}; the page on all cores, by the browser's clock",
        "× is how many times longer, or further off, the other is, in this run",
        "plain scipy: benchmarks/forward_others.py; a dense solve for the operator; "
        "RBFInterpolator for places; its import alone at the start",
    )
    yield Report("all parts in one run", columns, tuple(rows), notes)


def _row(part: str, line: Line) -> tuple[object, ...]:
    value = line.value
    here = value if isinstance(value, str) else cell(value)
    others: list[str] = []
    for other in (line.scipy, line.peer):
        times = other / value if other is not None and isinstance(value, float) else None
        others += [cell(other), cell(times)]
    return part, f"{line.what}, {line.unit}", here, line.promised, *others


def _ms(seconds: float | None) -> float | None:
    return None if seconds is None else 1e3 * seconds


def _start() -> Iterator[Line]:
    """Until something can be done at all: processor time of programs that only begin."""
    yield Line("tomoskin --help", "ms", _begun("from tomoskin.cli import main; main(['--help'])"),
               "< 150")  # fmt: skip
    yield Line("import tomoskin", "ms", _begun("import tomoskin"), "< 300")
    names = "from tomoskin import ForwardModel, Locator, OneStep, Skin"
    plain = _begun("import numpy, scipy.linalg, scipy.sparse.linalg")
    peer = _begun("import pyeit.eit.jac, pyeit.mesh") if INSTALLED else None
    yield Line(names, "ms", _begun(names), scipy=plain, peer=peer)


def _begun(code: str) -> float:
    """Median processor time of a program, the interpreter's own included, ms."""
    used = [0.0]
    for _ in range(REPEATS):
        subprocess.run([sys.executable, "-c", code], check=True, capture_output=True)
        children = resource.getrusage(resource.RUSAGE_CHILDREN)
        used.append(children.ru_utime + children.ru_stime)
    return 1e3 * float(np.median(np.diff(used)))


def _forward() -> Iterator[Line]:
    """The model and its operator: one mesh, every call of the three by turns."""
    case = disc("3k", CELLS)
    model = ForwardModel(case.mesh, PATTERN, case.contact_impedance)
    sigma = 1.0 + 0.1 * np.random.default_rng(1).random(len(case.mesh.cells))
    script = Script(case.mesh, PATTERN, case.contact_impedance)
    operator, plain = set_up(case), _plain_operator(script, sigma)
    change = 1e-3 * model.solve(sigma).voltages
    calls: dict[str, Callable[[], object]] = {
        "forward": lambda: model.solve(sigma),
        "scipy forward": lambda: script.voltages(sigma),
        "jacobian": lambda: model.jacobian(sigma),
        "scipy jacobian": lambda: script.jacobian(sigma),
        "set-up": lambda: set_up(case),
        "scipy set-up": lambda: _plain_operator(script, sigma),
        "picture": lambda: operator(change),
        "scipy picture": lambda: plain @ change,
    }
    if INSTALLED:
        peer = Peer(case.mesh, PATTERN)
        its = peer.set_up(ALPHA)
        calls |= peer.calls(sigma, ALPHA) | {"peer picture": lambda: -np.dot(its, change)}
    times = medians(calls, SECONDS)
    for name, what in MODEL.items():
        plain_ms, peer_ms = (_ms(times.get(f"{who} {name}")) for who in ("scipy", "peer"))
        yield Line(what, "ms", _ms(times[name]), scipy=plain_ms, peer=peer_ms)
    touch, what = measure_touch(case).times, "voltages of a touch of 150 cells (local update)"
    plain_ms, peer_ms = _ms(touch["script forward"]), _ms(times.get("peer forward"))
    yield Line(what, "ms", _ms(touch["update"]), "≤ 0.5", plain_ms, peer_ms)


def _plain_operator(script: Script, sigma: FloatArray) -> FloatArray:
    """(n_cells, n_meas), as it stands in textbooks: one unknown for each cell."""
    jacobian = script.jacobian(sigma)
    normal = jacobian.T @ jacobian
    normal[np.diag_indices_from(normal)] += ALPHA**2 * np.sqrt(normal.diagonal())
    solved: FloatArray = scipy.linalg.solve(normal, jacobian.T, assume_a="pos")
    return solved


def _frame() -> Iterator[Line]:
    for electrodes in (8, 16):
        skin = Skin.load(f"textile-disc-{electrodes}").altered({"mesh": {"cells": CELLS}})
        row = frame.row(prepare(skin))
        what = f"bytes to touches, {electrodes} electrodes"
        yield Line(f"{what}, p50", "ms", row["p50 ms"])
        yield Line(f"{what}, p99", "ms", row["p99 ms"], "≤ 1" if electrodes == 16 else "")
    yield Line("allocated memory that stays", "B a frame", row["growth B/frame"])


def _touch() -> Iterator[Line]:
    """Places on the twin: fitted to the voltages, and learnt from labelled presses."""
    skin = Skin.load(SKIN)
    fitted = prepare(skin.altered({"touch": {"method": "fit"}}))
    yield Line(
        "two touches fitted to the voltages, p50", "ms a frame", frame.row(fitted, 2)["p50 ms"]
    )
    dv, xy = labelled_presses(skin, 1, LEARNT + TESTED)
    began = time.process_time()
    locator = Locator.fit(dv[:LEARNT], xy[:LEARNT], skin=skin)
    learning = time.process_time() - began
    began = time.process_time()
    places = np.concatenate([locator.predict(row[None])[0] for row in dv[LEARNT:]])
    each = 1e3 * (time.process_time() - began) / TESTED
    rows = (dv - dv[:LEARNT].mean(axis=0)) / dv[:LEARNT].std(axis=0)
    began = time.process_time()
    spline = RBFInterpolator(rows[:LEARNT], xy[:LEARNT], kernel="linear", smoothing=SMOOTHING)
    plain_learning = time.process_time() - began
    off, plain_off = (
        1e3 * float(np.median(np.linalg.norm(p - xy[LEARNT:], axis=1)))
        for p in (places, spline(rows[LEARNT:]))
    )
    yield Line(f"learning from {LEARNT} labelled presses", "s", learning, "< 2", plain_learning)
    yield Line("place of a frame by it", "ms", each, "< 1")
    yield Line(f"error of {TESTED} other places, median", "mm", off, scipy=plain_off)


def _twin() -> Iterator[Line]:
    rate = twin.row("textile-disc-16", "ideal", CELLS)["frames /s"]
    yield Line("exact frames, three moving presses", "1/s", rate, "≥ 5,000")


def _wire() -> Iterator[Line]:
    for electrodes in (8, 16):
        row = frame.wire_row(electrodes, packed=False)
        what = f"decoded, {electrodes} electrodes"
        yield Line(what, "frames/s", row["decoded frames/s"])
        yield Line(f"{what}, by what 1 Mbaud carries", "×", row["times"], "≥ 20")


def _session() -> Iterator[Line]:
    skin, rng = Skin.load(SKIN), np.random.default_rng(1)
    n = Scan.of(skin.pattern()).n_samples
    samples = rng.integers(200, 3000, (500, n)).astype("<u2")
    frames = [Frame(0, 0, 0.0, 0x1A2B, 0, 0, row) for row in samples]
    with tempfile.TemporaryDirectory() as folder:
        used = _recorded(Path(folder) / "paced.mcap", skin, frames)
        yield Line("recording 1,000 frames/s", "% of a core", used, "< 20")
        seek = _sought(Path(folder) / "long.mcap", skin, frames)
        yield Line(f"open and seek in {SOUGHT // 60} minutes", "ms", seek, "< 200")


def _at(frames: list[Frame], number: int, rate: float) -> tuple[Frame, bytes]:
    """Frames come again and again, with new numbers and times; and the bytes of one."""
    ticks, seconds = round(number * 16e6 / rate), number / rate
    frame = frames[number % len(frames)]
    return replace(frame, sequence=number, ticks=ticks, host_time=seconds), encode(frame)


def _recorded(path: Path, skin: Skin, frames: list[Frame]) -> float:
    """Per cent of a core that a recording takes, frame by frame at their own pace."""
    recorder = Recorder(path, lambda: SessionWriter(path, skin), None, lambda *_: None)
    worker = Worker(recorder, Capacity(50_000, "oldest"), lambda *_: None)
    worker.start()
    made = [_at(frames, number, 1000.0) for number in range(1000 * RECORDED)]
    processor = begun = 0.0
    for number, (item, raw) in enumerate(made):
        if number == WARM:
            processor, begun = time.process_time(), time.monotonic()
        worker.put(RawRead(item.host_time, raw))
        worker.put(MarkedFrame(item, Mark.NONE))
        if number >= WARM:
            time.sleep(max(item.host_time - (time.monotonic() - begun), 0.0))
    used = time.process_time() - processor
    worker.end()
    worker.join()
    return 100 * used / RECORDED


def _sought(path: Path, skin: Skin, frames: list[Frame]) -> float:
    """Median of ms until a session is open and a random frame of it is there."""
    with SessionWriter(path, skin) as session:
        for number in range(100 * SOUGHT):
            item, raw = _at(frames, number, 100.0)
            session.raw(item.host_time, raw)
            session.frame(item)
    sought = []
    for place in np.random.default_rng(1).uniform(0, SOUGHT - 1, 40):
        start = time.perf_counter()
        with SessionReader(path) as reader:
            first = next(reader.frames(since=place)).frame
            sought.append(1e3 * (time.perf_counter() - start))
        assert abs(first.host_time - place) <= 0.01
    return statistics.median(sought)


def _page() -> Iterator[Line]:
    """Numbers of the page itself, on all cores: a browser is several processes at once."""
    if missing := _missing():
        yield Line(f"not measured: no {missing}", "–", None)
        return
    before = os.sched_getaffinity(0)
    os.sched_setaffinity(0, range(os.cpu_count() or 1))
    page.CELLS = {CELLS: page.CELLS[CELLS]}  # its finer sheets take minutes more
    try:
        for what, value, promised in next(page.run()).rows:
            name, _, unit = what.partition(", ")
            yield Line(name, unit or "–", value, promised)
    finally:
        os.sched_setaffinity(0, before)


def _missing() -> str:
    if not (STATIC / "index.html").is_file():
        return "built page (make page)"
    if find_spec("playwright") is None:
        return "playwright (requirements/dev.txt)"
    return "" if any(map(shutil.which, ("chromium", "google-chrome"))) else "Chromium"
