"""Labelled classes in another session, and channel mappings from a few presses."""

from __future__ import annotations

import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from report import Report
from tomoskin import Skin
from tomoskin.core import DataError
from tomoskin.learning import (
    ChannelMapping,
    Classifier,
    against_rest,
    ring_of,
    solve_channel_mapping,
)
from tomoskin.model.pattern import match_rows
from tomoskin.twin import COMMON_PRESSES, SetPlan, make_shard

SHARED = Path(__file__).parents[2] / "shared" / "data"

TEN = 10
DRAWS = 5
FEW = (50, 100, 200, 400)
TRIALS = 10
COUNTS = (3, 5, 10)
REAL_COUNTS = (5, 10, 20)
REAL_TRIALS = 6
SHEETS = ("textile-disc-8", "textile-disc-16")

VARSENS = ("noPattern", "fullCB", "parallel", "concentric", "radial")
ROUND = {"round16_single550": 16, "round16_single500_ohmc": 16, "round8_single500_ohmc": 8}

Floats = NDArray[np.float64]
Batch = tuple[Floats, Floats]


def run(data: Path | None) -> tuple[Report, ...]:
    """Measure on the public sets in ``data``, by default those beside the checkout."""
    data = data or SHARED
    if not data.is_dir():
        raise DataError("expected the public recordings", where=str(data), hint="--data FOLDER")
    folder = data / "eskin_membrane8_sixpoint"
    return (*_six_points(folder), _changed(folder), _twin(), _real(data))


def readings(folder: Path, number: int, *, smooth: bool) -> Batch:
    """(n, 210) changes, and flags, of one batch.

    The 1,680 rows are 210 readings, each eight times (pairs reversed, drive and measurement
    exchanged): they are averaged. ``smooth`` takes them against the level of the untouched frames
    instead of the one just before.
    """
    with np.load(folder / f"batch{number}.npz") as kept:
        pairs = np.sort(np.stack([kept["inj"], kept["meas"]], axis=1), axis=2) @ [8, 1]
        _, reading = np.unique(np.sort(pairs, axis=1), axis=0, return_inverse=True)
        mean = np.eye(reading.max() + 1)[reading.ravel()] / 8
        before, after = (kept[key].astype(float) @ mean for key in ("rms_before", "rms_after"))
        change = against_rest(after, before) if smooth else after - before
        return change, kept["pressed"].astype(float)


def _six_points(folder: Path) -> Iterator[Report]:
    rows, few = [], []
    for smooth in (False, True):
        for first, second in ((1, 2), (2, 1)):
            old, new = (readings(folder, k, smooth=smooth) for k in (first, second))
            level = "all" if smooth else "the one before"
            rows.append((f"{first} to {second}", level, *_transfer(old, new)))
            if smooth:
                few.append((f"{first} to {second}", *_with_few(old, new)))
    yield Report(
        "six flags at once, from one batch to the other: part of the frames with all six right",
        (
            *("batches", "untouched frames"),
            *("as learnt", "no labels", "ten, evenly spread", "ten at random"),
            *("within the new batch", "said probability", "called unknown", "learnt in s"),
        ),
        tuple(rows),
        (
            "eskin_membrane8_sixpoint; another day and another depth (3 and 5 mm). No labels: the "
            "frames of the new batch, without labels, are at hand; labelled frames are not counted",
            f"ten at random: mean of {DRAWS} draws (seeds 0 to {DRAWS - 1}); within the new batch: "
            "learnt from all labels of four fifths of it",
        ),
    )
    yield Report(
        "the same with fewer frames of the new batch at hand, no labels",
        ("batches", *(f"{n} frames" for n in FEW)),
        tuple(few),
        (f"mean of {DRAWS} draws; all frames of the new batch tested",),
    )


def _changed(folder: Path) -> Report:
    """The other batch as if its skin had been changed as well: names cannot always be carried."""
    rows = []
    for first, second in ((1, 2), (2, 1)):
        known = Classifier.fit(*readings(folder, first, smooth=True))
        dv, flags = readings(folder, second, smooth=True)
        gains = np.exp(0.7 * np.random.default_rng(DRAWS).normal(size=dv.shape[1]))
        some = np.random.default_rng(DRAWS).permutation(len(dv))[:100]
        one, four = (_turned(folder, dv, steps) for steps in (1, 4))
        scenes = {
            "nothing": (dv, flags),
            "100 frames": (dv[some], flags[some]),
            "gains, deviation 0.7 of their logarithm": (dv * gains, flags),
            "sign": (-dv, flags),
            "half turned by one electrode": ((dv + one) / 2, flags),
            "turned by one electrode": (one, flags),
            "turned by four": (four, flags),
        }
        for what, (data, truth) in scenes.items():
            rows.append((f"{first} to {second}", what, *_honest(known, data, truth)))
    return Report(
        "the same where more has changed: right, said, unknown",
        ("batches", "what has changed", "as learnt", "no labels", "ten at random"),
        tuple(rows),
        ("against all untouched frames; seed 5 of gains, frames and labels",),
    )


def _honest(known: Classifier, dv: Floats, truth: Floats) -> Iterator[str]:
    some = np.full_like(truth, np.nan)
    chosen = np.random.default_rng(DRAWS).permutation(len(dv))[:TEN]
    some[chosen] = truth[chosen]
    rest = np.setdiff1d(np.arange(len(dv)), chosen)
    for one in (known, known.in_session(dv), known.in_session(dv, some)):
        told = one.predict(dv[rest])
        right = float((told.flags == truth[rest]).all(axis=1).mean())
        yield f"{right:.2f}, {told.probability.mean():.2f}, {told.rejected.mean():.0%}"


def _turned(folder: Path, dv: Floats, steps: int) -> Floats:
    """Readings (n, 210) as if each electrode stood where one some steps on was."""
    with np.load(folder / "batch1.npz") as kept:
        pairs = np.sort(np.stack([kept["inj"], kept["meas"]], axis=1), axis=2) @ [8, 1]
    codes = np.unique(np.sort(pairs, axis=1), axis=0)
    electrodes = (np.stack([codes // 8, codes % 8], axis=-1) + steps) % 8
    turned = np.sort(np.sort(electrodes, axis=2) @ [8, 1], axis=1)
    row = {tuple(code): k for k, code in enumerate(codes.tolist())}
    out = np.empty_like(dv)
    out[:, [row[tuple(code)] for code in turned.tolist()]] = dv
    return out


def _transfer(old: Batch, new: Batch) -> tuple[object, ...]:
    dv, flags = new
    start = time.process_time()
    known = Classifier.fit(*old)
    fitted = known.in_session(dv)
    taken = time.process_time() - start
    answers = fitted.predict(dv)
    spread = _with_labels(
        known, new, np.arange(len(dv) // (2 * TEN), len(dv), len(dv) // TEN)[:TEN]
    )
    drawn = [
        _with_labels(known, new, np.random.default_rng(seed).permutation(len(dv))[:TEN])
        for seed in range(DRAWS)
    ]
    return (
        round(_right(known, new), 3),
        round(_right(fitted, new), 3),
        round(spread, 3),
        round(float(np.mean(drawn)), 3),
        round(Classifier.fit(dv, flags).right, 3),
        round(float(answers.probability.mean()), 3),
        round(float(answers.rejected.mean()), 3),
        round(taken, 2),
    )


def _with_labels(known: Classifier, new: Batch, chosen: NDArray[np.int64]) -> float:
    dv, flags = new
    some = np.full_like(flags, np.nan)
    some[chosen] = flags[chosen]
    rest = np.setdiff1d(np.arange(len(dv)), chosen)
    return _right(known.in_session(dv, some), (dv[rest], flags[rest]))


def _with_few(old: Batch, new: Batch) -> Iterator[float]:
    known = Classifier.fit(*old)
    for count in FEW:
        found = []
        for seed in range(DRAWS):
            chosen = np.random.default_rng(seed).permutation(len(new[0]))[:count]
            found.append(_right(known.in_session(new[0][chosen]), new))
        yield round(float(np.mean(found)), 3)


def _right(known: Classifier, batch: Batch) -> float:
    return float((known.predict(batch[0]).flags == batch[1]).all(axis=1).mean())


def _twin() -> Report:
    rows = []
    for name in SHEETS:
        skin = Skin.load(name)
        scenes = [_scrambled(skin, seed) for seed in range(TRIALS)]
        for rest in (True, False):
            for count in COUNTS:
                found = [_solved(skin, scene, count, rest=rest) for scene in scenes]
                rows.append((name, "yes" if rest else "no", count, *_tally(found)))
    return Report(
        "scrambled wires on the twin",
        ("skin", "untouched frames known", "presses", *_TALLY),
        tuple(rows),
        (
            "rotation, mirroring, none to two swaps and polarity drawn at random, seeds 0 to "
            f"{TRIALS - 1}; textile preset, whose mesh and dents are not the model's",
        ),
    )


_TALLY = ("right", "sure", "sure and wrong", "s")
Solved = tuple[bool, bool, float]


def _tally(found: list[Solved]) -> tuple[object, ...]:
    right, sure, seconds = (np.array(column) for column in zip(*found, strict=True))
    wrong = int((sure & ~right).sum())
    return (f"{right.mean():.0%}", f"{sure.mean():.0%}", wrong, round(float(seconds.mean()), 1))


def _scrambled(skin: Skin, seed: int) -> tuple[ChannelMapping, Floats, Floats, Floats]:
    random, n = np.random.default_rng(seed), skin.n_electrodes
    wiring = ChannelMapping.as_drawn(n).turned(
        ring_of(skin), int(random.integers(n)), mirrored=bool(random.integers(2))
    )
    for _ in range(random.integers(3)):
        a, b = random.choice(n, 2, replace=False).tolist()
        wiring = wiring.swapped(a, b)
    arrays = make_shard(
        SetPlan(wiring.applied(skin).to_toml(), COMMON_PRESSES, "textile", seed, 40), 0
    )
    wiring = replace(wiring, reversed=bool(random.integers(2)))
    single = np.isfinite(arrays["xy_m"]).all(axis=1)
    sign = -1.0 if wiring.reversed else 1.0
    change = sign * (arrays["voltages"] - arrays["reference"])[single]
    return wiring, change, arrays["xy_m"][single], sign * arrays["reference"]


def _solved(
    skin: Skin, scene: tuple[ChannelMapping, Floats, Floats, Floats], count: int, *, rest: bool
) -> Solved:
    wiring, dv, xy, reference = scene
    start = time.process_time()
    found = solve_channel_mapping(
        dv[:count], xy[:count], skin, reference=reference if rest else None
    )
    return found.mapping == wiring, found.sure, time.process_time() - start


def _real(data: Path) -> Report:
    rows = []
    for name, skin, dv, xy in _skins(data):
        ring = ring_of(skin)
        near = {
            ChannelMapping.as_drawn(len(ring)).turned(ring, k, mirrored=False).electrodes
            for k in (-1, 0, 1)
        }
        for count in REAL_COUNTS:
            found = []
            for seed in range(REAL_TRIALS):
                chosen = np.random.default_rng(seed).permutation(len(dv))[:count]
                start = time.process_time()
                told = solve_channel_mapping(dv[chosen], xy[chosen], skin)
                taken = time.process_time() - start
                found.append((told.mapping.electrodes in near, told.sure, taken))
            rows.append((name, count, *_tally(found)))
    return Report(
        "orientation of public skins",
        ("set", "presses", *_TALLY),
        tuple(rows),
        (
            f"presses drawn at random (seeds 0 to {REAL_TRIALS - 1}); right: within one electrode "
            "of the orientation that the sets' notes state, itself fitted to a few degrees",
            "a uniform disc is the model, also of the four patterned skins; polarity is not known",
        ),
    )


_DISC = """format = 1
[skin]
name = "{name}"
[outline]
shape = "disc"
diameter = "{diameter} mm"
[electrodes]
count = {count}
width = "{width} mm"
first = "{first} deg"
order = "{order}"
contact_impedance = "1 ohm*m"
[material]
sheet_resistance = "1000 ohm/sq"
[drive]
pattern = "opposite"
current = "1 mA"
[mesh]
cells = 1200
[touch]
sign = "both"
"""


def _skins(data: Path) -> Iterator[tuple[str, Skin, Floats, Floats]]:
    for name in VARSENS:
        with np.load(data / "eskin_varsens16" / f"{name}.npz") as kept:
            first = (float(kept["ring_offset_deg"]) + 180) % 360 - 180
            order = "counter-clockwise" if kept["ring_handedness"] > 0 else "clockwise"
            place = {"diameter": 88, "width": 3, "count": 16, "first": first, "order": order}
            skin = Skin.from_toml(_DISC.format(name=name, **place))
            yield name, skin, *_in_order(skin, kept["dv"].astype(float), kept)
    for name, count in ROUND.items():
        with np.load(data / "eskin_hydrogel_round" / f"{name}.npz") as kept:
            place = {"diameter": 170, "width": 5, "count": count, "first": -99}
            skin = Skin.from_toml(_DISC.format(name=name, order="counter-clockwise", **place))
            yield name, skin, *_in_order(skin, kept["v_down"].astype(float) - kept["v_up"], kept)


def _in_order(skin: Skin, dv: Floats, kept: np.lib.npyio.NpzFile) -> tuple[Floats, Floats]:
    """Changes in the pattern's rows, and labels in m; each drive stands twice, the first counts."""
    half = dv.shape[1] // 2
    match = match_rows(skin.pattern(), kept["inj"][:half], kept["meas"][:half])
    return match.apply(dv[:, :half]), 1e-3 * kept["xy_mm"].astype(float)
