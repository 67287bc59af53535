"""``tomoskin bench``: the benchmarks of the source tree."""

from __future__ import annotations

import ast
import importlib
import os
import re
import sys
from contextlib import contextmanager
from inspect import signature
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, NamedTuple

import typer

from tomoskin.cli.named_files import Otherwise, Reads
from tomoskin.cli.output import JsonFlag, tables, tell
from tomoskin.core import DataError, no_such

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence
    from types import ModuleType

    from rich.table import Table

_FOLDER = Path(__file__).parents[3] / "benchmarks"


def bench(
    name: Annotated[
        str,
        typer.Argument(
            metavar="NAME", help="Name of one benchmark; --list shows the names.", show_default=True
        ),
    ] = "whole",
    data: Annotated[
        Path | None,
        typer.Option(help="Folder of public recordings, for benchmarks that need it."),
        Reads(),
    ] = None,
    cores: Annotated[
        int | None,
        typer.Option(
            min=1,
            help="Number of processor cores. Default: 1, or the number that the benchmark needs.",
        ),
    ] = None,
    into: Annotated[
        Path | None,
        typer.Option(help="Markdown file in which the section of that name is replaced."),
        Otherwise("only the section between its two marks is replaced"),
    ] = None,
    list_: Annotated[
        bool, typer.Option("--list", help="List the benchmarks, and measure nothing.")
    ] = False,
    json: JsonFlag = False,
) -> None:
    """Run one benchmark and show its tables.

    Without a name it runs all parts and shows one table, in two to three minutes. A single part
    takes from seconds to an hour.
    """
    from threadpoolctl import threadpool_limits

    benchmarks = known_benchmarks()
    if list_:
        for key, benchmark in benchmarks.items():
            typer.echo(f"{key:<18} {benchmark.summary}")
        return
    if name not in benchmarks:
        raise typer.BadParameter(no_such(name, benchmarks, "a benchmark"), param_hint="NAME")
    module = load_benchmark(benchmarks[name].module)
    usual: int = getattr(module, "CORES", 1)
    cores = cores or usual
    os.sched_setaffinity(0, sorted(os.sched_getaffinity(0))[-cores:])
    os.environ["RAYON_NUM_THREADS"] = str(cores)  # the native engine reads it at each call
    with threadpool_limits(cores), _on_path():  # processes that it starts look there too
        part = into and load_benchmark("report").Part.of(into, name)
        run = getattr(module, benchmarks[name].function)
        reports = tuple(run(data) if "data" in signature(run).parameters else run())
    if part:
        part.write(reports)
    tell(reports, _lines(reports), json=json)


class Benchmark(NamedTuple):
    """A module of the folder, one of its functions, and what that measures."""

    module: str
    function: str
    summary: str


def known_benchmarks() -> dict[str, Benchmark]:
    """Benchmarks of the source tree by name: ``run_x`` has that of its module and ``_x``."""
    if not _FOLDER.is_dir():
        raise DataError(
            "the benchmarks are not part of the installed package",
            where="tomoskin bench",
            hint="run it from a checkout of the source code",
        )
    benchmarks = {}
    for path in sorted(_FOLDER.glob("*.py")):
        tree = ast.parse(path.read_text(encoding="utf-8"))
        for node in tree.body:
            if isinstance(node, ast.FunctionDef) and re.fullmatch(r"run(_\w+)?", node.name):
                about = tree if node.name == "run" else node
                summary = (ast.get_docstring(about) or "").partition("\n")[0]
                name = path.stem + node.name.removeprefix("run")
                benchmarks[name] = Benchmark(path.stem, node.name, summary)
    return benchmarks


def load_benchmark(name: str) -> ModuleType:
    """Import a module of the folder."""
    with _on_path():
        return importlib.import_module(name)


@contextmanager
def _on_path() -> Iterator[None]:
    """The folder is on the path for a while only: its short names would hide those of tests."""
    sys.path.insert(0, str(_FOLDER))
    try:
        yield
    finally:
        sys.path.remove(str(_FOLDER))


def _lines(reports: Sequence[Any]) -> Iterator[str | Table]:
    for report in reports:
        for table in tables(report.title, report.columns, report.rows):
            yield table
            yield ""
        for note in report.notes:
            yield f"  {note}"
    machine = ", ".join(f"{key} {value}" for key, value in reports[-1].machine.items())
    yield f"  {machine}"
