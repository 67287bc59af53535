"""What a careful stranger breaks: damaged files and requests, kill −9, a full disk, no broker."""

from __future__ import annotations

import tempfile
from collections.abc import Iterator
from pathlib import Path

from reliability_files import judges, make_bases
from reliability_page import ask
from reliability_run import brokers, full_disk, killed, prepared_skin
from report import Report, progress
from trials import HANG, MEMORY, Tally, attempt

REQUESTS, FILES, KILLS, DISKS, BROKERS = 20_000, 2_000, 200, 50, 30
COLUMNS = ("kind", "attempts", "refused", "accepted", "tracebacks", "hangs", "memory", "wrong")


def run(data: Path | None) -> tuple[Report, ...]:
    """All of it, a quarter of an hour; ``data`` is not needed."""
    del data
    tallies = list(_tallies())
    rows = tuple(_row(tally) for tally in tallies)
    notes = (
        "refused: with a TomoskinError, one sentence; accepted: what was read is right, or nothing "
        "in the file can tell that it is not",
        f"hangs: over {HANG:g} s; memory: over {MEMORY >> 20} MB in the process",
        "wrong: a frame that was never written, other arrays or positions, a repair that loses "
        "frames, a run that stands still",
        "a kill before the first second leaves a file that is refused",
        *(f"{fault}: {text}" for tally in tallies for fault, text in tally.examples.items()),
    )
    return (Report("reliability", COLUMNS, rows, notes),)


def _tallies() -> Iterator[Tally]:
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for kind, judge in judges(make_bases(folder), folder).items():
            progress(kind)
            yield attempt(kind, FILES, judge)
        prepared = prepared_skin()
        for kind, count, judge in (
            ("kill −9", KILLS, killed(prepared, folder)),
            ("full disk", DISKS, full_disk(prepared, folder)),
            ("broker", BROKERS, brokers(prepared)),
        ):
            progress(kind)
            yield attempt(kind, count, judge)
        progress("requests")
        (folder / "page").mkdir()
        yield ask(REQUESTS, folder / "page")


def _row(tally: Tally) -> tuple[str | int, ...]:
    faults = (tally.counts[name] for name in ("traceback", "hang", "memory", "wrong"))
    refused, accepted = tally.counts["refused"], tally.counts["accepted"]
    return (tally.kind, sum(tally.counts.values()) - tally.counts["memory"], refused, accepted,
            *faults)  # fmt: skip
