"""What a benchmark returns: a table, and the machine that it was made on."""

from __future__ import annotations

import os
import platform
import sys
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import scipy

from tomoskin.model.forward import choose_engine


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
        "vectors": engine.vectors,
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


def cell(value: float | None) -> str:
    """Three figures, or a dash for what was not measured."""
    if not value:
        return "–" if value is None else "0"
    return f"{value:,.{max(0, 2 - int(np.floor(np.log10(abs(value)))))}f}"


def named(columns: Sequence[str], row: Sequence[Any]) -> dict[str, Any]:
    """A row's values by the names of their columns."""
    return dict(zip(columns, row, strict=True))


def progress(text: str) -> None:
    """Say on the terminal what is being measured; nothing where there is none."""
    if sys.stderr.isatty():
        print(f"measuring {text}", file=sys.stderr)
