"""Two fingers on a public hydrogel by a calibration of single presses."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from report import Report
from tomoskin import Locator
from tomoskin.core import DataError
from tomoskin.learning import Several

SHARED = Path(__file__).parents[2] / "shared" / "data"


def run(data: Path | None) -> tuple[Report, ...]:
    """On the public set in ``data``."""
    folder = (data or SHARED) / "eskin_hydrogel_round"
    if not folder.is_dir():
        raise DataError("expected the public recordings", where=str(folder), hint="--data FOLDER")
    return (report(folder),)


def report(folder: Path) -> Report:
    dv, pairs = (_changes(folder / f"round16_{name}.npz") for name in ("single550", "twotouch"))
    with np.load(folder / "round16_single550.npz") as kept:
        locator = Locator.fit(dv, 1e-3 * kept["xy_mm"].astype(float))
    several = Several.of(locator)
    with np.load(folder / "round16_twotouch.npz") as kept:
        truth, numbers = kept["separation_mm"].tolist(), kept["row"].tolist()
    rows = []
    for far, number, readings in zip(truth, numbers, several(pairs), strict=True):
        says = "too close" if readings[0].close else "one"
        apart: object = "–"
        if len(readings) == 2:
            says = "two"
            one, other_one = readings
            apart = round(1e3 * float(np.hypot(one.x - other_one.x, one.y - other_one.y)))
        places = "; ".join(f"{1e3 * r.x:.0f}, {1e3 * r.y:.0f}" for r in readings)
        rows.append((far, number, says, places, apart))
    other = several(_changes(folder / "round16_single500_ohmc.npz")[:200])
    wrong = sum(len(readings) == 2 for readings in other)
    return Report(
        "two fingers on a hydrogel skin, learnt from single presses",
        ("truly apart, mm", "row", "says", "places, mm", "found apart, mm"),
        tuple(rows),
        (
            "eskin_hydrogel_round, 16 electrodes, learnt from single550; the method was shaped "
            "with these rows in view, so they are no held-out test; "
            "rows 4 to 7 of the 108 mm file hold the same numbers as rows 0 to 3",
            f"of 200 single presses of another session (single500_ohmc) {wrong} are taken for two",
        ),
    )


def _changes(path: Path) -> np.ndarray:
    with np.load(path) as kept:
        return np.asarray(kept["v_down"].astype(float) - kept["v_up"])
