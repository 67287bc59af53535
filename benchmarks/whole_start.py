"""Until something can be done at all: processor time of programs that only begin."""

from __future__ import annotations

import resource
import statistics
import subprocess
import sys
from collections.abc import Iterator

import forward_peer
from whole_line import Line

REPEATS = 5


def start_lines() -> Iterator[Line]:
    """Help and import."""
    yield Line(
        "tomoskin --help", "ms", _ms("from tomoskin.cli import main; main(['--help'])"), "< 150"
    )
    names = "ForwardModel, Locator, OneStep, Skin"
    yield Line("import tomoskin", "ms", _ms("import tomoskin"), "< 300")
    yield Line(
        f"from tomoskin import {names}",
        "ms",
        _ms(f"from tomoskin import {names}"),
        scipy=_ms("import numpy, scipy.linalg, scipy.sparse.linalg"),
        peer=_ms("import pyeit.eit.jac, pyeit.mesh") if forward_peer.INSTALLED else None,
    )


def _ms(code: str) -> float:
    """Median processor time of a program, the interpreter's own included."""
    return statistics.median(_once(code) for _ in range(REPEATS))


def _once(code: str) -> float:
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    subprocess.run([sys.executable, "-c", code], check=True, capture_output=True)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return 1e3 * (after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime)
