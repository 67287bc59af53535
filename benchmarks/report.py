"""What a benchmark returns and how it is written down: tables, the machine, times, figures."""

from __future__ import annotations

import gc
import os
import platform
import sys
import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from datetime import date
from pathlib import Path
from typing import Any, Self

import numpy as np
import scipy
from numpy.typing import NDArray

from tomoskin.core import DataError, write_text
from tomoskin.model.forward import choose_engine

Floats = NDArray[np.float64]
Row = Mapping[str, Any]
MOST_REPEATS = 200
SHARED = Path(__file__).resolve().parents[2] / "shared" / "data"


def machine() -> dict[str, str]:
    """Processor, cores that may be used, versions, engine and its vector instructions."""
    engine = choose_engine()
    return {
        "processor": _processor(),
        "cores": str(len(os.sched_getaffinity(0))),
        "python": platform.python_version(),
        "numpy": np.__version__,
        "scipy": scipy.__version__,
        "engine": engine.name,
        "vectors": "those of scipy's build" if engine.core is None else engine.core.vector_code,
    }


def _processor() -> str:
    info = Path("/proc/cpuinfo")
    if info.exists():
        for line in info.read_text().splitlines():
            if line.startswith("model name"):
                return line.split(":", 1)[1].strip()
    return platform.processor() or platform.machine()


@dataclass(frozen=True)
class Report:
    """Rows under ``columns``, with a title and notes on how they were measured."""

    title: str
    columns: tuple[str, ...]
    rows: tuple[tuple[Any, ...], ...]
    notes: tuple[str, ...] = ()
    machine: dict[str, str] = field(default_factory=machine)


def table(title: str, rows: Iterable[Row], *notes: str, across: str = "") -> Report:
    """A report whose columns are the names in its rows, as they come; a row may lack some.

    Rows that are the same up to the column ``across`` become one, with a cell for each value of it.
    """
    every = tuple(rows)
    columns = tuple(dict.fromkeys(name for row in every for name in row))
    cells = tuple(tuple(row.get(name, "–") for name in columns) for row in every)
    if across:
        columns, cells, note = joined(columns, cells, columns.index(across))
        notes = (note, *notes)
    return Report(title, columns, cells, notes)


def joined(
    columns: tuple[str, ...], rows: Iterable[tuple[Any, ...]], at: int
) -> tuple[tuple[str, ...], tuple[tuple[Any, ...], ...], str]:
    """Columns and rows with what is behind the column ``at`` in cells, and a note on those."""
    cells: dict[tuple[Any, ...], dict[str, str]] = {}
    for row in rows:
        cell = "; ".join(map(str, row[at + 1 :]))
        cells.setdefault(row[:at], {})[f"{columns[at]}: {row[at]}"] = cell
    names = tuple(dict.fromkeys(name for some in cells.values() for name in some))
    lines = tuple((*case, *(some.get(name, "–") for name in names)) for case, some in cells.items())
    return (*columns[:at], *names), lines, f"in each cell: {'; '.join(columns[at + 1 :])}"


def cell(value: float | None) -> str:
    """Three figures, or a dash for what was not measured."""
    if not value:
        return "–" if value is None else "0"
    return f"{value:,.{max(0, 2 - int(np.floor(np.log10(abs(value)))))}f}"


def percent(parts: Any) -> str:
    """The mean of parts or truths in per cent."""
    return f"{100 * float(np.mean(parts)):.0f} %"


def mm(*metres: Any, digits: int = 2) -> tuple[float, ...]:
    """Metres as rounded millimetres."""
    return tuple(round(1e3 * float(value), digits) for value in metres)


def rms(values: Any) -> float:
    """Root mean square."""
    return float(np.sqrt(np.mean(np.square(values))))


def progress(text: str) -> None:
    """Say on the terminal what is being measured; nothing where there is none."""
    if sys.stderr.isatty():
        print(f"measuring {text}", file=sys.stderr)


def available(data: Path | None, *needed: str) -> Path | None:
    """The folder of public recordings, by default that beside the checkout, if all is there."""
    folder = data or SHARED
    return folder if all((folder / name).exists() for name in ("", *needed)) else None


def recordings(data: Path | None, *needed: str) -> Path:
    """The same; DataError where something is missing."""
    folder = available(data, *needed)
    if folder is None:
        where = str((data or SHARED) / " and ".join(needed))
        raise DataError("expected the public recordings", where=where, hint="--data FOLDER")
    return folder


Clock = Callable[[], float]


def clock() -> tuple[Clock, str]:
    """Processor time where one core is used, since other programs do not add to it."""
    if len(os.sched_getaffinity(0)) == 1:
        return time.process_time, "processor time"
    return time.perf_counter, "wall time"


def spent(work: Callable[[], object]) -> float:
    """Seconds of processor time."""
    start = time.process_time()
    work()
    return time.process_time() - start


def medians(
    calls: Mapping[str, Callable[[], object]], seconds: float, *, least: int = 1
) -> dict[str, float]:
    """Median time of each call, s: turn about for ``seconds``, and ``least`` turns.

    A call runs a few times in a row in its turn, so that all find caches of their own making.
    """
    now, _ = clock()
    taken: dict[str, list[float]] = {name: [] for name in calls}
    gc.collect()
    gc.disable()
    began = now()
    turns = 0
    while turns < least or now() - began < seconds:
        turns += 1
        for name, call in calls.items():
            turn, most = 0.0, min(0.05, seconds / 10)
            while turn <= most and len(taken[name]) < MOST_REPEATS:
                start = now()
                call()
                taken[name].append(now() - start)
                turn += taken[name][-1]
        if all(len(times) >= MOST_REPEATS for times in taken.values()):
            break
    gc.enable()
    return {name: float(np.median(times)) for name, times in taken.items()}


@dataclass(frozen=True)
class Part:
    """What stands between ``<!-- bench NAME -->`` and ``<!-- end NAME -->`` of a Markdown file."""

    file: Path
    before: str
    text: str
    after: str

    @classmethod
    def of(cls, file: Path, name: str) -> Self:
        """Look for it, before anything is measured."""
        begin, end = f"<!-- bench {name} -->\n", f"<!-- end {name} -->\n"
        text = file.read_text(encoding="utf-8", errors="replace") if file.is_file() else ""
        if text.count(begin) != 1 or text.count(end) != 1:
            raise DataError(
                f"expected a Markdown file with one {begin.strip()} and, below it, {end.strip()}",
                where=str(file),
                hint="the tables are written between these two lines",
            )
        before, rest = text.split(begin)
        now, after = rest.split(end)
        return cls(file, before + begin, now, end + after)

    def write(self, reports: Sequence[Report]) -> None:
        """Put tables, their notes and the machine there."""
        words = ", ".join(f"{key} {value}" for key, value in reports[-1].machine.items())
        parts = [f"\n{date.today():%-d %B %Y}; {words}.\n", *map(_markdown, reports)]
        text = self.before + "\n".join(parts) + "\n" + self.after
        write_text(self.file, text, overwrite=True)


def _markdown(report: Report) -> str:
    rule = ["---"] + ["---:"] * (len(report.columns) - 1)
    rows = (report.columns, rule, *report.rows)
    lines = "\n".join(f"| {' | '.join(map(str, row))} |" for row in rows)
    notes = "\n".join(f"- {note}" for note in report.notes)
    title = report.title[:1].upper() + report.title[1:]
    return f"### {title}\n\n{lines}\n" + (f"\n{notes}\n" if notes else "")
