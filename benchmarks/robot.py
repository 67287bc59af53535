"""Milliseconds from a contact on the twin to the command of an arm that draws back."""

from __future__ import annotations

from pathlib import Path

from from_examples import load_example
from report import Report, progress
from tomoskin.model.skin import Skin

SKINS = ("textile-disc-8", "textile-disc-16")
PRESSES, SEED = 30, 11
COLUMNS = (
    *("skin", "presses", "answered", "one scan", "bytes to contacts", "contact to command"),
    *("the slowest", "promised"),
)


def run(data: Path | None) -> tuple[Report, ...]:
    """Press the skins of ``examples/reflex.py``; ``data`` is not needed."""
    del data
    reflex, rows = load_example("reflex"), []
    for name in SKINS:
        progress(name)
        found = reflex.measured(Skin.load(name), PRESSES, SEED)
        promised = f"{found['one scan, ms'] + 5:.1f}"
        counted = [found.pop(key) for key in ("presses", "answered")]
        rows.append((name, *counted, *(f"{value:.1f}" for value in found.values()), promised))
    notes = (
        "ms, medians; promised: one scan and 5 ms",
        "a touch without doubt is reported in the first frame that shows it, else in the second",
    )
    return (Report("a reflex", COLUMNS, tuple(rows), notes),)
