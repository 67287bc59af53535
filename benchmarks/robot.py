"""Milliseconds from a contact on the twin to the command of an arm that draws back."""

from __future__ import annotations

from collections.abc import Iterator

from bench_rig import load_example
from report import Report, progress, table
from tomoskin.model.skin import Skin

SKINS = ("textile-disc-8", "textile-disc-16")
PRESSES, SEED = 30, 11


def run() -> Iterator[Report]:
    reflex, rows = load_example("reflex"), []
    for name in SKINS:
        progress(name)
        row = reflex.measured(Skin.load(name), PRESSES, SEED)
        promised = {"promised": round(row["one scan, ms"] + 5, 1)}
        rows.append({"skin": name} | {k: round(v, 1) for k, v in row.items()} | promised)
    yield table(
        "a reflex",
        rows,
        "medians; promised: one scan and 5 ms",
        "a touch without doubt is reported in the first frame that shows it, else in the second",
    )
