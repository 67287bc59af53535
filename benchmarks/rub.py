"""Positions of touches from touches everywhere, and from a finger that slides."""

from __future__ import annotations

import tempfile
import time
from dataclasses import replace
from pathlib import Path

import numpy as np

from life import Condition, Worn, touches
from locator import SHARED, Set, held, mean_error, plain
from report import Report, progress
from sliding import LEAD, SPEED, START, Way, stage
from tomoskin import Skin
from tomoskin.core import DataError
from tomoskin.files.session import SessionReader
from tomoskin.learning import Rubbing
from tomoskin.run import simulate
from tomoskin.sensing.segment import Region
from tomoskin.sensing.signal import Readout
from tomoskin.twin import Script

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
they are those of the skin of the same kind. Settings were chosen on the first two (seeds 1 to 3).
"""

TOUCHED, ASKED, LABELS, PLAIN = 500, 225, (0, 5, 25), 25
SEED = 32

SLIDES, WITHIN = (4, 5, 6), 0.09
"""Seeds of the twin, and m about the middle. Settings were chosen on seeds 1 to 3."""

ELECTRODES, SLID = 8, "textile-disc-8"
SECONDS, FORCES, PRESSES = 120.0, (2.5, 7.0), 80
UNTOUCHED = 0.1
"""Seconds before the onset up to which frames are untouched."""


def run(data: Path | None) -> tuple[Report, ...]:
    """Rub the public sets in ``data``, by default those beside the checkout."""
    data = data or SHARED
    if not data.is_dir():
        raise DataError("expected the public recordings", where=str(data), hint="--data FOLDER")
    return _public(data), _slid()


def _public(data: Path) -> Report:
    rows = []
    for name, ring in SKINS.items():
        progress(name)
        known = Set.of(data / f"{name}.npz", _disc(*ring))
        order = np.random.default_rng(SEED).permutation(len(known.dv))
        touched, asked = known.at(order[:TOUCHED]), known.at(order[-ASKED:])
        alone = plain(touched.dv[:PLAIN], touched.xy[:PLAIN], asked.dv)
        error = 1e3 * np.linalg.norm(alone - asked.xy, axis=1).mean()
        learnt = (_rubbed(touched, asked, labelled) for labelled in LABELS)
        rows.append((Path(name).name, *learnt, round(float(error), 1)))
    return Report(
        "rubbed, not pressed",
        ("skin", *(f"{n} labels" for n in LABELS), f"plain process, {PLAIN} labels alone"),
        tuple(rows),
        (
            "mean error in mm, part in the 90 % ellipses, s of processor to learn",
            f"{TOUCHED} touches, {ASKED} others asked, seed {SEED}; settings chosen on the "
            "first two skins",
        ),
    )


def _slid() -> Report:
    """A finger that slides on the twin; presses are asked, and the finger's own positions."""
    skin, rows = Skin.load(SLID), []
    for seed in SLIDES:
        progress(f"slide {seed}")
        slid, asked = _slide(seed), _pressed(skin, PRESSES, seed)
        few = _pressed(skin, LABELS[1], seed + 100)
        unknown = np.full(slid.xy.shape, np.nan)
        found = Rubbing.of(slid.dv, skin)
        both = Rubbing.of(
            np.vstack([few.dv, slid.dv]), skin, np.vstack([few.xy, unknown])
        ).locator()
        locator, behind = found.locator(), slid.at(slice(None, None, 10))
        scores = [(one, which) for one in (locator, both) for which in (asked, behind)]
        rows.append((seed, *(f"{mean_error(*s):.1f}, {held(*s):.0%}" for s in scores)))
    return Report(
        f"a finger that slides on {SLID} of the twin",
        (
            *("seed", "no labels: presses", "frames that slide"),
            *(f"{LABELS[1]} labels: presses", "frames that slide"),
        ),
        tuple(rows),
        (
            "mean error in mm, part in the 90 % ellipses; friction drags the sheet behind a "
            "finger that slides, and the positions are the sheet's",
            f"{SECONDS:g} s at {1e3 * SPEED:g} mm/s from corner to corner, one force of "
            f"{FORCES[0]:g} to {FORCES[1]:g} N; {PRESSES} presses of 2 to 6 N; preset textile; "
            "settings chosen on seeds 1 to 3",
        ),
    )


def _slide(seed: int) -> Set:
    """Frames less the untouched ones before, and where the finger was in the middle of each."""
    prepared, scan_time = stage(ELECTRODES)
    skin, readout = prepared.skin, Readout.of(prepared.scan, prepared.skin.readout)
    force = float(np.random.default_rng((seed, 999)).uniform(*FORCES))
    way = replace(Way.drawn(seed, 0, SECONDS, WITHIN), force=force)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "run.mcap"
        script = Script.from_toml(way.script("textile", "slide"))
        simulate(script, skin, path, seed=seed, advance=lambda _, __: None)
        with SessionReader(path) as session:
            frames = [
                (item.frame.host_time, readout(item.frame).values) for item in session.frames()
            ]
    times = np.array([time for time, _ in frames])
    since = times - times[0] - LEAD - START + scan_time / 2
    volts = np.array([values for _, values in frames])
    slid = (since > 0) & (since < way.end)
    xy = np.array([way.at(time) for time in since[slid]])
    return Set(volts[slid] - volts[since < -UNTOUCHED].mean(axis=0), xy, skin.pattern(), skin)


def _pressed(skin: Skin, n: int, seed: int) -> Set:
    xy, forces = touches(Region.of(skin), n, np.random.default_rng((seed, 5)))
    return Set(Worn(skin, Condition(0), seed)(xy, forces), xy, skin.pattern(), skin)


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
