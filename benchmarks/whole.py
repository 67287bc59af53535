"""All of it in one table, beside plain scipy and pyEIT in the same run; two to three minutes."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from pathlib import Path
from tempfile import TemporaryDirectory

import forward_peer
import frame
import session
import twin
import wire
from forward_cases import clock
from report import Report, cell, named, progress
from tomoskin.model.skin import Skin
from tomoskin.pipeline import prepare
from whole_forward import forward_lines
from whole_line import Line
from whole_page import page_lines
from whole_start import start_lines
from whole_touch import touch_lines

CELLS = 3000
RECORDED, SOUGHT = 10, 600
"""Seconds recorded at their own pace, and of the session that is sought in."""


def run(data: Path | None) -> tuple[Report, ...]:
    """Measure every part; ``data`` is not needed."""
    del data
    parts: tuple[tuple[str, Callable[[], Iterator[Line]]], ...] = (
        ("start", start_lines),
        ("forward", forward_lines),
        ("frame", _frame_lines),
        ("touch", touch_lines),
        ("twin", _twin_lines),
        ("wire", _wire_lines),
        ("session", _session_lines),
        ("page", _on_all_cores),
    )
    rows = []
    for number, (part, lines) in enumerate(parts, start=1):
        progress(f"{part} ({number} of {len(parts)})")
        rows += [_row(part, line) for line in lines()]
    return (
        Report(
            "all parts in one run",
            ("part", "what", "measured", "promised", "plain scipy", "×", "pyEIT", "×"),
            tuple(rows),
            (
                f"16 electrodes, adjacent, {CELLS:,} triangles unless said otherwise; medians of "
                f"{clock()[1]}; the page on all cores, by the browser's clock",
                "× is how many times longer, or further off, the other is, in this run",
                "plain scipy: benchmarks/forward_script.py; a dense solve for the operator; "
                "RBFInterpolator for places; its import alone at the start",
                f"{forward_peer.name()}: point electrodes, its own interface",
                "frame: two moving presses on the twin; touch: presses on the twin, preset textile",
            ),
        ),
    )


def _row(part: str, line: Line) -> tuple[object, ...]:
    value = line.value
    here = value if isinstance(value, str) else cell(value)
    others: list[str] = []
    for other in (line.scipy, line.peer):
        times = other / value if other is not None and isinstance(value, float) else None
        others += [cell(other), cell(times)]
    return part, f"{line.what}, {line.unit}", here, line.promised, *others


def _frame_lines() -> Iterator[Line]:
    for electrodes in (8, 16):
        skin = Skin.load(f"textile-disc-{electrodes}").altered({"mesh": {"cells": CELLS}})
        found = named(frame.COLUMNS, frame.row(prepare(skin)))
        what = f"bytes to touches, {electrodes} electrodes"
        yield Line(f"{what}, p50", "ms", found["p50 ms"])
        promised = "≤ 1" if electrodes == 16 else ""
        yield Line(f"{what}, p99", "ms", found["p99 ms"], promised)
    yield Line("allocated memory that stays", "B a frame", found["growth B/frame"])


def _twin_lines() -> Iterator[Line]:
    found = named(twin.COLUMNS, twin.row("textile-disc-16", "ideal", CELLS))
    yield Line("exact frames, three moving presses", "1/s", found["frames /s"], "≥ 5,000")


def _wire_lines() -> Iterator[Line]:
    for electrodes in (8, 16):
        found = named(wire.COLUMNS, wire.row(electrodes, packed=False))
        what = f"decoded, {electrodes} electrodes"
        yield Line(what, "frames/s", found["decoded frames/s"])
        yield Line(f"{what}, by what 1 Mbaud carries", "×", found["times"], "≥ 20")


def _session_lines() -> Iterator[Line]:
    skin = Skin.load(session.SKIN)
    frames = session.frames_of(skin)
    with TemporaryDirectory() as folder:
        paced, long = Path(folder) / "paced.mcap", Path(folder) / "long.mcap"
        row = session.recorded(paced, skin, frames, RECORDED, paced=True)
        share = named(session.RECORDED, row)["% of a core"]
        yield Line("recording 1,000 frames/s", "% of a core", share, "< 20")
        row = session.opened(session.of_length(long, skin, frames, SOUGHT), SOUGHT)
        seek = named(session.OPENED, row)["open and seek ms"]
        yield Line(f"open and seek in {SOUGHT // 60} minutes", "ms", seek, "< 200")


def _on_all_cores() -> Iterator[Line]:
    """A browser is several processes that run at once."""
    before = os.sched_getaffinity(0)
    os.sched_setaffinity(0, range(os.cpu_count() or 1))
    try:
        yield from page_lines()
    finally:
        os.sched_setaffinity(0, before)
