"""Positions of touches from touches everywhere, and from a finger that slides."""

from __future__ import annotations

import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np

from bench_rig import INSIDE_90, scan_time, stage
from life import Condition, Worn, touches
from locator import Set, disc, held, mean_error, plain
from report import Floats, Report, progress, recordings, table
from sliding import LEAD, SPEED, START, Way, recorded
from tomoskin import Locator, Skin
from tomoskin.core import Detection, Touch
from tomoskin.extras.alignment import Rubbing
from tomoskin.sensing.segment import Region
from tomoskin.sensing.track import SlideCorrection, likeliest_lag

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


def run(data: Path | None) -> Iterator[Report]:
    """Rub the public sets in ``data``, by default those beside the checkout."""
    yield _public(recordings(data))
    yield _slid()


def _public(data: Path) -> Report:
    rows = []
    for name, (first, order) in SKINS.items():
        progress(name)
        turn = f"{first - 360 if first > 180 else first} deg"
        known = Set.of(data / f"{name}.npz", disc(first=turn, order=order))
        drawn = np.random.default_rng(SEED).permutation(len(known.dv))
        touched, asked = known.at(drawn[:TOUCHED]), known.at(drawn[-ASKED:])
        alone = plain(touched.dv[:PLAIN], touched.xy[:PLAIN], asked.dv)
        error = 1e3 * np.linalg.norm(alone - asked.xy, axis=1).mean()
        begun = time.process_time()
        learnt = {f"{n} labels": _rubbed(touched, asked, n) for n in LABELS}
        taken = (time.process_time() - begun) / len(LABELS)
        alone_text = {f"plain process, {PLAIN} labels alone": round(float(error), 1)}
        rows.append(
            {"skin": Path(name).name} | learnt | alone_text | {"learnt in s": round(taken, 1)}
        )
    return table(
        "rubbed, not pressed",
        rows,
        "mean error in mm, part in the 90 % ellipses; s of processor; refused: the touches do not "
        "say where they were",
        f"{TOUCHED} touches, {ASKED} others asked, seed {SEED}; settings chosen on the first two "
        "skins",
    )


def _slid() -> Report:
    """A finger that slides on the twin; presses are asked, and the finger's own positions."""
    skin, rows = Skin.load(SLID), []
    for seed in SLIDES:
        progress(f"slide {seed}")
        (slid, times), asked = _slide(seed), _pressed(skin, PRESSES, seed)
        few = _pressed(skin, LABELS[1], seed + 100)
        unknown = np.full(slid.xy.shape, np.nan)
        found = Rubbing.of(slid.dv, skin)
        both = Rubbing.of(
            np.vstack([few.dv, slid.dv]), skin, np.vstack([few.xy, unknown])
        ).locator()
        locator, behind = found.locator(), slid.at(slice(None, None, 10))
        row: dict[str, object] = {"seed": seed}
        for name, one in (("no labels", locator), (f"{LABELS[1]} labels", both)):
            for what, which in (("presses", asked), ("frames that slide", behind)):
                row[f"{name}: {what}"] = f"{mean_error(one, which):.1f}, {held(one, which):.0%}"
        lag = likeliest_lag(times, locator.predict(slid.dv)[0])
        row["lag found, mm"] = round(1e3 * lag)
        row["no labels: frames that slide, with that lag"] = _followed(locator, slid, times, lag)
        rows.append(row)
    return table(
        f"a finger that slides on {SLID} of the twin",
        rows,
        "mean error in mm, part in the 90 % ellipses",
        f"{SECONDS:g} s at {1e3 * SPEED:g} mm/s from corner to corner, one force of "
        f"{FORCES[0]:g} to {FORCES[1]:g} N; {PRESSES} presses of 2 to 6 N; preset textile; "
        "settings chosen on seeds 1 to 3",
    )


def _followed(locator: Locator, slid: Set, times: Floats, lag: float) -> str:
    """Mean error and part in the ellipses of touches that are moved by the lag."""
    slides, inside, errors = SlideCorrection(lag), [], []
    for now, at, (x, y), cov in zip(times, slid.xy, *locator.predict(slid.dv), strict=True):
        sd_x, sd_y = np.sqrt(np.diag(cov)).tolist()
        seen = Detection(x, y, sd_x, sd_y, 1e-3, -1.0, np.empty(0, int), cov_xy=cov[0, 1])
        touch = Touch(1, "decrease", 0.0, seen)
        slides = slides.after([touch], now)
        d = slides.of_finger(touch).detection
        error = np.array([d.x, d.y]) - at
        spread = np.array([[d.sd_x**2, d.cov_xy], [d.cov_xy, d.sd_y**2]])
        errors.append(np.linalg.norm(error))
        inside.append(error @ np.linalg.solve(spread, error) < INSIDE_90)
    return f"{1e3 * np.mean(errors):.1f}, {np.mean(inside):.0%}"


def _slide(seed: int) -> tuple[Set, Floats]:
    """Frames less the untouched ones before, where the finger was in the middle of each, and s."""
    prepared = stage(ELECTRODES)
    skin = prepared.skin
    force = float(np.random.default_rng((seed, 999)).uniform(*FORCES))
    way = replace(Way.drawn(seed, 0, SECONDS, WITHIN), force=force)
    frames, _ = recorded(prepared, way, "textile", "slide", seed)
    times = np.array([frame.host_time for frame in frames])
    since = times - times[0] - LEAD - START + scan_time(prepared) / 2
    volts = np.array([prepared.readout(frame).values for frame in frames])
    slid = (since > 0) & (since < way.end)
    xy = np.array([way.at(time) for time in since[slid]])
    dv = volts[slid] - volts[since < -UNTOUCHED].mean(axis=0)
    return Set(dv, xy, skin.pattern(), skin), since[slid]


def _pressed(skin: Skin, n: int, seed: int) -> Set:
    xy, forces = touches(Region.of(skin), n, np.random.default_rng((seed, 5)))
    return Set(Worn(skin, Condition(0), seed)(xy, forces), xy, skin.pattern(), skin)


def _rubbed(touched: Set, asked: Set, labelled: int) -> str:
    labels = np.full(touched.xy.shape, np.nan)
    labels[:labelled] = touched.xy[:labelled]
    assert touched.skin is not None
    found = Rubbing.of(touched.dv, touched.skin, labels, pattern=touched.pattern)
    if not found.holds:
        return "refused"
    locator = found.locator()
    return f"{mean_error(locator, asked):.1f}, {held(locator, asked):.0%}"
