"""Some cases of touch_plant, with a third of the frames: what a change does, in a minute."""

from __future__ import annotations

from pathlib import Path

from report import Report
from touch_plant import SEEDS, Case, table

CASES = (Case("8", 2, 0.0), Case("8", 3, 0.1), Case("16", 1, 0.1), Case("16", 3, 0.1))


def run(data: Path | None) -> tuple[Report, ...]:
    """One sheet of each seed."""
    del data
    return (table(CASES, SEEDS, sheets=1),)
