"""100,000 frames of the Pico's image in its emulator: two minutes, or more on a busy machine."""

from __future__ import annotations

from pathlib import Path

from board import PICO_CASES, pico_report
from report import Report

FRAMES = 100_000


def run(data: Path | None) -> tuple[Report, ...]:
    """The fastest scan that the slowest settling allows; ``data`` is not needed."""
    del data
    return (pico_report(FRAMES, PICO_CASES[:1]),)
