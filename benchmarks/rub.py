"""Places of touches from touches everywhere: without labels, and with five."""

from __future__ import annotations

import time
from pathlib import Path

import numpy as np

from locator import SHARED, Set, held, mean_error
from report import Report, progress
from tomoskin import Skin
from tomoskin.calibration import Rubbing
from tomoskin.core import DataError

SKINS = {
    "eskin_varsens16/noPattern": (258, "clockwise"),
    "eskin_varsens16/radial": (257, "clockwise"),
    "eskin_varsens16/parallel": (261, "clockwise"),
    "eskin_varsens16/concentric": (287, "counter-clockwise"),
    "eskin_varsens16/fullCB": (285, "counter-clockwise"),
    "eskin_varsens16_more/cam09_05": (258, "clockwise"),
    "eskin_varsens16_more/cam09_04": (285, "counter-clockwise"),
}
"""Degrees of the first electrode, and the way round of the others. The last two are not known:
they are those of the skin of the same kind. Settings were chosen on the first two (seeds 100, 101).
"""

TOUCHED, ASKED, LABELS = 500, 225, 5
SEED = 31


def run(data: Path | None) -> tuple[Report, ...]:
    """Rub the public sets in ``data``, by default those beside the checkout."""
    data = data or SHARED
    if not data.is_dir():
        raise DataError("expected the public recordings", where=str(data), hint="--data FOLDER")
    rows = []
    for name, ring in SKINS.items():
        progress(name)
        known = Set.of(data / f"{name}.npz", _disc(*ring))
        order = np.random.default_rng(SEED).permutation(len(known.dv))
        touched, asked = known.at(order[:TOUCHED]), known.at(order[-ASKED:])
        rows.append((Path(name).name, *(_rubbed(touched, asked, n) for n in (0, LABELS))))
    return (
        Report(
            "rubbed, not pressed",
            ("skin", "no labels", f"{LABELS} labels"),
            tuple(rows),
            (
                "mean error in mm, part in the 90 % ellipses, s of processor to learn",
                f"{TOUCHED} touches, {ASKED} others asked, seed {SEED}; settings chosen on the "
                "first two skins",
            ),
        ),
    )


def _disc(first: int, order: str) -> Skin:
    turn = f"{first - 360 if first > 180 else first} deg"
    return Skin.load("textile-disc-16").altered(
        {
            "outline": {"diameter": "80 mm"},
            "electrodes": {"width": "3 mm", "first": turn, "order": order},
        }
    )


def _rubbed(touched: Set, asked: Set, labelled: int) -> str:
    labels = np.full(touched.xy.shape, np.nan)
    labels[:labelled] = touched.xy[:labelled]
    begun = time.process_time()
    assert touched.skin is not None
    found = Rubbing.of(touched.dv, touched.skin, labels, pattern=touched.pattern)
    if not found.holds:
        return f"refused: {'; '.join(found.findings)}"
    locator = found.locator()
    taken = time.process_time() - begun
    return f"{mean_error(locator, asked):.1f}, {held(locator, asked):.0%}, {taken:.1f} s"
