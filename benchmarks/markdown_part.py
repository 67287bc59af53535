"""The part of a Markdown file that a benchmark writes: its tables, their notes and the machine."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import date
from pathlib import Path
from typing import Any, Self

from tomoskin.core import DataError, write_text


@dataclass(frozen=True)
class Part:
    """What stands between ``<!-- bench NAME -->`` and ``<!-- end NAME -->``."""

    file: Path
    before: str
    after: str

    @classmethod
    def of(cls, file: Path, name: str) -> Self:
        """Find it, before anything is measured."""
        begin, end = f"<!-- bench {name} -->\n", f"<!-- end {name} -->\n"
        text = file.read_text(encoding="utf-8", errors="replace") if file.is_file() else ""
        if text.count(begin) != 1 or text.count(end) != 1:
            raise DataError(
                f"expected a Markdown file with one {begin.strip()} and, below it, {end.strip()}",
                where=str(file),
                hint="the tables are written between these two lines",
            )
        before, rest = text.split(begin)
        return cls(file, before + begin, end + rest.split(end)[1])

    def write(self, reports: Sequence[Any]) -> None:
        """Put tables, their notes and the machine there."""
        machine = ", ".join(f"{key} {value}" for key, value in reports[-1].machine.items())
        parts = [f"\n{date.today():%-d %B %Y}; {machine}.\n", *map(_markdown, reports)]
        text = self.before + "\n".join(parts) + "\n" + self.after
        write_text(self.file, text, overwrite=True)


def _markdown(report: Any) -> str:
    rule = ["---"] + ["---:"] * (len(report.columns) - 1)
    rows = (report.columns, rule, *report.rows)
    table = "\n".join(f"| {' | '.join(map(str, row))} |" for row in rows)
    notes = "\n".join(f"- {note}" for note in report.notes)
    title = report.title[:1].upper() + report.title[1:]
    return f"### {title}\n\n{table}\n" + (f"\n{notes}\n" if notes else "")
