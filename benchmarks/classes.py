"""Labelled classes in another session, and channel mappings from a few presses."""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from report import Floats, Report, recordings, table
from tomoskin import Skin
from tomoskin.extras.classes import Classifier, against_rest
from tomoskin.extras.labelled import COMMON_PRESSES, SetPlan, make_shard
from tomoskin.learning import ChannelMapping, ring_of, solve_channel_mapping
from tomoskin.model.pattern import match_rows

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

Batch = tuple[Floats, Floats]


def run(data: Path | None) -> Iterator[Report]:
    """Measure on the public sets in ``data``, by default those beside the checkout."""
    data = recordings(data)
    folder = data / "eskin_membrane8_sixpoint"
    batches = {
        (first, second, smooth): [readings(folder, k, smooth=smooth) for k in (first, second)]
        for smooth in (False, True)
        for first, second in ((1, 2), (2, 1))
    }
    smoothed = {f"{a} to {b}": both for (a, b, smooth), both in batches.items() if smooth}
    yield table(
        "six flags at once, from one batch to the other: part of the frames with all six right",
        (
            {"batches": f"{a} to {b}", "untouched frames": "all" if smooth else "the one before"}
            | _transfer(*both)
            for (a, b, smooth), both in batches.items()
        ),
        "eskin_membrane8_sixpoint; another day and another depth (3 and 5 mm). No labels: the "
        "frames of the new batch, without labels, are at hand; labelled frames are not counted",
        f"ten at random: mean of {DRAWS} draws (seeds 0 to {DRAWS - 1}); within the new batch: "
        "learnt from all labels of four fifths of it",
    )
    yield table(
        "the same with fewer frames of the new batch at hand, no labels",
        ({"batches": name} | _with_few(*both) for name, both in smoothed.items()),
        f"mean of {DRAWS} draws; all frames of the new batch tested",
    )
    yield table(
        "the same where more has changed: right, said, unknown",
        (row for name, both in smoothed.items() for row in _changed(folder, name, *both)),
        "against all untouched frames; seed 5 of gains, frames and labels",
        across="batches",
    )
    yield table(
        "scrambled wires on the twin",
        _twin(),
        "rotation, mirroring, none to two swaps and polarity drawn at random, seeds 0 to "
        f"{TRIALS - 1}; textile preset, whose mesh and dents are not the model's",
        across="presses",
    )
    yield table(
        "orientation of public skins",
        _real(data),
        f"presses drawn at random (seeds 0 to {REAL_TRIALS - 1}); right: within one electrode "
        "of the orientation that the sets' notes state, itself fitted to a few degrees",
        across="presses",
    )


def _pairs(kept: np.lib.npyio.NpzFile) -> NDArray[np.int64]:
    """(n_rows, 2) drive and measurement of each row as numbers, however they are written."""
    ends = np.sort(np.stack([kept["inj"], kept["meas"]], axis=1), axis=2) @ [8, 1]
    return np.sort(ends, axis=1)


def readings(folder: Path, number: int, *, smooth: bool) -> Batch:
    """(n, 210) changes, and flags, of one batch.

    The 1,680 rows are 210 readings, each eight times (pairs reversed, drive and measurement
    exchanged): they are averaged. ``smooth`` takes them against the level of the untouched frames
    instead of the one just before.
    """
    with np.load(folder / f"batch{number}.npz") as kept:
        _, reading = np.unique(_pairs(kept), axis=0, return_inverse=True)
        mean = np.eye(reading.max() + 1)[reading.ravel()] / 8
        before, after = (kept[key].astype(float) @ mean for key in ("rms_before", "rms_after"))
        change = against_rest(after, before) if smooth else after - before
        return change, kept["pressed"].astype(float)


def _changed(folder: Path, name: str, old: Batch, new: Batch) -> Iterator[dict[str, Any]]:
    """The other batch as if its skin had been changed as well: names cannot always be carried."""
    known, (dv, flags) = Classifier.fit(*old), new
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
        ways = zip(("as learnt", "no labels", "ten at random"), _honest(known, data, truth),
                   strict=True)  # fmt: skip
        yield {"what has changed": what, "batches": name, **dict(ways)}


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
        codes = np.unique(_pairs(kept), axis=0)
    electrodes = (np.stack([codes // 8, codes % 8], axis=-1) + steps) % 8
    turned = np.sort(np.sort(electrodes, axis=2) @ [8, 1], axis=1)
    row = {tuple(code): k for k, code in enumerate(codes.tolist())}
    out = np.empty_like(dv)
    out[:, [row[tuple(code)] for code in turned.tolist()]] = dv
    return out


def _transfer(old: Batch, new: Batch) -> dict[str, Any]:
    dv, flags = new
    start = time.process_time()
    known = Classifier.fit(*old)
    fitted = known.in_session(dv)
    taken = time.process_time() - start
    answers, n = fitted.predict(dv), len(dv)
    evenly = np.arange(n // (2 * TEN), n, n // TEN)[:TEN]
    drawn = [np.random.default_rng(seed).permutation(n)[:TEN] for seed in range(DRAWS)]
    return {
        "as learnt": round(_right(known, new), 3),
        "no labels": round(_right(fitted, new), 3),
        "ten, evenly spread": round(_with_labels(known, new, evenly), 3),
        "ten at random": round(float(np.mean([_with_labels(known, new, d) for d in drawn])), 3),
        "within the new batch": round(Classifier.fit(dv, flags).right, 3),
        "said probability": round(float(answers.probability.mean()), 3),
        "called unknown": round(float(answers.rejected.mean()), 3),
        "learnt in s": round(taken, 2),
    }


def _with_labels(known: Classifier, new: Batch, chosen: NDArray[np.int64]) -> float:
    dv, flags = new
    some = np.full_like(flags, np.nan)
    some[chosen] = flags[chosen]
    rest = np.setdiff1d(np.arange(len(dv)), chosen)
    return _right(known.in_session(dv, some), (dv[rest], flags[rest]))


def _with_few(old: Batch, new: Batch) -> dict[str, float]:
    known, (dv, _) = Classifier.fit(*old), new
    drawn = [np.random.default_rng(seed).permutation(dv) for seed in range(DRAWS)]
    parts = {n: [_right(known.in_session(each[:n]), new) for each in drawn] for n in FEW}
    return {f"{count} frames": round(float(np.mean(some)), 3) for count, some in parts.items()}


def _right(known: Classifier, batch: Batch) -> float:
    return float((known.predict(batch[0]).flags == batch[1]).all(axis=1).mean())


def _twin() -> Iterator[dict[str, Any]]:
    for name in SHEETS:
        skin = Skin.load(name)
        scenes = [_scrambled(skin, seed) for seed in range(TRIALS)]
        for rest, count in ((rest, count) for rest in (True, False) for count in COUNTS):
            solved = [_solved(skin, scene, count, rest=rest) for scene in scenes]
            case = {"skin": name, "untouched frames known": "yes" if rest else "no"}
            yield case | {"presses": count} | _tally(solved)


Solved = tuple[bool, bool]


def _tally(solved: Sequence[Solved]) -> dict[str, Any]:
    right, sure = (np.array(column) for column in zip(*solved, strict=True))
    return {
        "right": f"{right.mean():.0%}",
        "sure": f"{sure.mean():.0%}",
        "sure and wrong": int((sure & ~right).sum()),
    }


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
    found = solve_channel_mapping(
        dv[:count], xy[:count], skin, reference=reference if rest else None
    )
    return found.mapping == wiring, found.sure


def _real(data: Path) -> Iterator[dict[str, Any]]:
    for name, skin, dv, xy in _skins(data):
        ring = ring_of(skin)
        near = {
            ChannelMapping.as_drawn(len(ring)).turned(ring, k, mirrored=False).electrodes
            for k in (-1, 0, 1)
        }
        for count in REAL_COUNTS:
            solved = []
            for seed in range(REAL_TRIALS):
                chosen = np.random.default_rng(seed).permutation(len(dv))[:count]
                told = solve_channel_mapping(dv[chosen], xy[chosen], skin)
                solved.append((told.mapping.electrodes in near, told.sure))
            yield {"set": name, "presses": count, **_tally(solved)}


def _skins(data: Path) -> Iterator[tuple[str, Skin, Floats, Floats]]:
    for name in VARSENS:
        with np.load(data / "eskin_varsens16" / f"{name}.npz") as kept:
            first = (float(kept["ring_offset_deg"]) + 180) % 360 - 180
            order = "counter-clockwise" if kept["ring_handedness"] > 0 else "clockwise"
            skin = _disc(
                88, {"count": 16, "width": "3 mm", "first": f"{first} deg", "order": order}
            )
            yield name, skin, *_in_order(skin, kept["dv"].astype(float), kept)
    for name, count in ROUND.items():
        with np.load(data / "eskin_hydrogel_round" / f"{name}.npz") as kept:
            skin = _disc(170, {"count": count, "width": "5 mm", "first": "-99 deg"})
            yield name, skin, *_in_order(skin, kept["v_down"].astype(float) - kept["v_up"], kept)


def _disc(diameter: int, electrodes: dict[str, Any]) -> Skin:
    return Skin.load("textile-disc-16").altered(
        {
            "outline": {"diameter": f"{diameter} mm"},
            "electrodes": {"order": "counter-clockwise", "contact_impedance": "1 ohm*m"}
            | electrodes,
            "material": {"sheet_resistance": "1000 ohm/sq"},
            "drive": {"pattern": "opposite", "current": "1 mA"},
            "mesh": {"cells": 1200},
            "touch": {"sign": "both"},
        }
    )


def _in_order(skin: Skin, dv: Floats, kept: np.lib.npyio.NpzFile) -> tuple[Floats, Floats]:
    """Changes in the pattern's rows, and labels in m; each drive stands twice, the first counts."""
    half = dv.shape[1] // 2
    match = match_rows(skin.pattern(), kept["inj"][:half], kept["meas"][:half])
    return match.apply(dv[:, :half]), 1e-3 * kept["xy_mm"].astype(float)
