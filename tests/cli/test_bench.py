"""`tomoskin bench`: a benchmark finds its neighbours while it runs, and nobody does afterwards."""

from __future__ import annotations

import json
import os
import sys
from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from pathlib import Path

    import pytest

command = import_module("tomoskin.cli.bench")  # the room's name for it is the function

_NEIGHBOUR = """
from dataclasses import dataclass, field

@dataclass
class Report:
    title: str
    columns: list
    rows: list
    notes: list = field(default_factory=list)

def table(number):
    return Report("squares", ["number", "square"], [[number, number * number]])
"""

_BENCHMARK = '''
"""Squares, in a process of their own."""
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from made_up_neighbour import table

def run():
    """Squares."""
    with ProcessPoolExecutor(1, mp_context=get_context("spawn")) as pool:
        return [pool.submit(table, 7).result()]
'''


def test_a_process_that_a_benchmark_starts_finds_its_modules(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "made_up_neighbour.py").write_text(_NEIGHBOUR)
    (tmp_path / "made_up_squares.py").write_text(_BENCHMARK)
    monkeypatch.setattr(command, "_FOLDER", tmp_path)
    monkeypatch.setattr(os, "sched_setaffinity", lambda *_: None)  # it would hold for other tests
    monkeypatch.setenv("RAYON_NUM_THREADS", "1")
    before = list(sys.path)

    command.bench("made_up_squares", None, None, None, list_=False, json=True)

    assert json.loads(capsys.readouterr().out)[0]["rows"] == [[7, 49]]
    assert sys.path == before
