"""What commands print: documents, lines and bars."""

from __future__ import annotations

import textwrap
import threading
import time
from dataclasses import asdict
from itertools import takewhile
from typing import TYPE_CHECKING, Annotated, Any, NamedTuple, Self

import typer

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from rich.table import Table

    from tomoskin.run import CheckFinding

_PATIENCE = 2.0
"""Seconds without a bar."""


class Bar:
    """Shows how far a long job is, on stderr, where that is a terminal; a context manager.

    A job that cannot say how far it is need not: the bar then only shows that it goes on.
    """

    def __init__(self, title: str) -> None:
        from rich import progress
        from rich.console import Console

        console = Console(stderr=True)
        columns = (
            progress.TextColumn("{task.description}"),
            progress.BarColumn(),
            progress.TaskProgressColumn("{task.percentage:>3.0f} %", text_format_no_percentage=""),
            progress.TimeRemainingColumn(),
        )
        shown = console.is_terminal
        self._progress = progress.Progress(
            *columns, console=console, transient=True, disable=not shown
        )
        self._task = self._progress.add_task(title, total=None)
        self._begun = time.monotonic()
        self._lock = threading.Lock()
        self._over = False
        self._timer = threading.Timer(_PATIENCE, self._show)
        self._timer.daemon = True

    def __call__(self, done: float, total: float) -> None:
        """Say that ``done`` of ``total`` is done."""
        self._progress.update(self._task, completed=done, total=total)
        if time.monotonic() - self._begun > _PATIENCE:
            self._show()

    def _show(self) -> None:
        with self._lock:
            if not self._over:
                self._progress.start()

    def __enter__(self) -> Self:
        """Show the bar when the job takes long."""
        if not self._progress.disable:
            self._timer.start()
        return self

    def __exit__(self, *_: object) -> None:
        """Remove the bar, however the job ended."""
        self._timer.cancel()
        with self._lock:
            self._over = True
            if self._progress.live.is_started:
                self._progress.stop()


JsonFlag = Annotated[bool, typer.Option("--json", help="Machine-readable output.")]
"""The --json option of a command."""


def emit(document: Any) -> None:
    """Write ``document`` as one line of JSON on stdout, at once."""
    from tomoskin.core import encode_json

    typer.echo(encode_json(document).decode())


def tell(document: Any, lines: Iterable[str | Table], *, json: bool) -> None:
    """Write what a command found: the ``document`` for programs, else ``lines`` for people."""
    if json:
        emit(document)
        return
    for line in lines:
        if isinstance(line, str):
            typer.echo(line)
        else:
            from rich.console import Console

            Console().print(line, crop=False)


def concluded(findings: Iterable[CheckFinding], *, json: bool, **facts: object) -> typer.Exit:
    """Write findings as they come, or with ``facts`` as a document; what is to be raised then: exit
    0 where all is as needed, else 1."""
    looked_at = []
    for finding in findings:
        looked_at.append(finding)
        if not json:
            typer.echo(f"{finding.mark:<4}  {finding.name:<10} {finding.text}")
    sound = all(finding.ok or finding.optional for finding in looked_at)
    if json:
        emit({"ok": sound, **facts, "findings": [asdict(finding) for finding in looked_at]})
    return typer.Exit(0 if sound else 1)


def remark(text: str) -> None:
    """Write a line on stderr that a person should see, whatever the command is for."""
    typer.echo(f"tomoskin: {text}", err=True)


def tables(
    title: str,
    headings: Sequence[str],
    rows: Sequence[Sequence[object]],
    width: int | None = None,
) -> list[Table]:
    """One table, or where ``width`` (the terminal's) is too little several, each with the columns
    that say what a row is about: the leading ones with text in them, at least the first.

    Nothing is cut off: headings break between words.
    """
    if width is None:
        from rich.console import Console

        width = Console().width
    columns = [
        _Column(heading, [str(row[number]) for row in rows])
        for number, heading in enumerate(headings)
    ]
    holds_text = (
        any(isinstance(row[number], str) for row in rows) for number in range(1, len(columns))
    )
    count = 1 + sum(1 for _ in takewhile(bool, holds_text))
    keys, rest = columns[:count], columns[count:]
    blocks = [list(keys)]
    for column in rest:
        needed = sum(c.width + 1 for c in (*blocks[-1], column)) - 1
        if needed > width and len(blocks[-1]) > count:
            blocks.append(list(keys))
        blocks[-1].append(column)
    return [_table(title if block is blocks[0] else "", block, count) for block in blocks]


class _Column(NamedTuple):
    heading: str
    values: list[str]

    @property
    def width(self) -> int:
        """Of its widest value, or of the longest word of its heading."""
        return max(map(len, (*self.heading.split(), *self.values)))


def _table(title: str, columns: Sequence[_Column], count: int) -> Table:
    """The first ``count`` columns say what a row is about."""
    from rich import box
    from rich.table import Table
    from rich.text import Text

    style = {"box": box.SIMPLE_HEAD, "show_edge": False, "pad_edge": False, "padding": 0}
    table = Table(title=title or None, **style)  # type: ignore[arg-type]
    for number, column in enumerate(columns):
        heading = "\n".join(textwrap.wrap(column.heading, column.width))
        table.add_column(
            Text(heading),
            justify="left" if number < count else "right",
            no_wrap=True,
            min_width=column.width,
            vertical="bottom",
        )
    for row in zip(*(column.values for column in columns), strict=True):
        table.add_row(*map(Text, row))
    return table
