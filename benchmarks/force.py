"""Newtons and millimetres: presses on the twin, a real fingertip and a hydrogel, and the bound."""

from __future__ import annotations

import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import product
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from scipy.optimize import minimize
from scipy.spatial.distance import cdist

from bench_rig import evenly, far_apart, gap
from report import Floats, Report, available, table
from tomoskin.core import Detection
from tomoskin.learning import AmountModel, AmountProcess, LabelledPresses, dent_map
from tomoskin.twin import Press, TwinSettings
from touch_lab import TwinLab

Tips = Sequence[float]
SKIN = "textile-disc-16"
SETS = ({11: 8e-3, 12: 10e-3, 13: 12e-3}, {21: 10e-3, 22: 12e-3, 23: 8e-3})
"""Radius of the tip of each seed, given to nobody. Tips of 6 to 15 mm in any order are refused as
contradictory labels: twenty presses do not teach a size. The second set was never chosen by."""

SPAN = {"force": (2.0, 20.0), "depth": (0.2e-3, 1.1e-3)}
"""What presses are taught, and asked, with: N; m of the 1.2 that the foam can be squeezed."""

BOUNDS = {
    "force": ((8e-3, 15e-3), (2.0, 5.0, 20.0)),
    "depth": ((8e-3, 10e-3, 12e-3), (0.2e-3, 0.5e-3, 1e-3)),
}
"""Radii, m, and amounts for which the bounds are told."""

DEPTHS: tuple[tuple[Mapping[int, Tips], int], ...] = (
    ({41: (8e-3,), 42: (10e-3,), 43: (12e-3,)}, 20),
    (dict.fromkeys((51, 52, 53), (0.008, 0.009, 0.01, 0.011, 0.012)), 20),
    (dict.fromkeys((54, 55, 56), (0.008, 0.009, 0.01, 0.011, 0.012)), 60),
)
"""Radii of the tips of each seed, one of which makes each press; how many presses are labelled."""

MOST = TwinSettings.preset("textile").contact.lock * 3e-3
"""M by which the foam can be squeezed."""

LABELLED, STAGES = 20, (0.5, 1.0, 0.5)
HELD_OUT, PAIRS, LOOP = 20, 10, (0.2, 0.5, 0.8, 1.0, 0.8, 0.5, 0.2)
DENTS, MAPS = {331: 6e-3, 332: 10e-3, 333: 14e-3, 334: 20e-3}, 4
FRAMES, BETWEEN, APART, NEAR = 5, 0.1, 0.06, 0.025

FOLDS = (2, 5)
BLOCKS = {"a block in the middle, 45 to 57 %": (0.45, 0.57), "the last 12 %": (0.88, 1.0)}


def run(data: Path | None) -> Iterator[Report]:
    """The twin needs no recordings; the others are left out where there are none."""
    for of in SPAN:
        yield table(
            f"bound of a {of}",
            _bound(of),
            "least deviation that one frame of 16 electrodes allows: "
            "Cramér–Rao of the twin without memory at the read-out's noise, from its own "
            "derivatives; position unknown; above 100 % it says that nothing is known",
            across="force N" if of == "force" else "depth mm",
        )
    yield table(
        "force of held-out presses on the twin's textile, 16 electrodes",
        (row for tips in SETS for row in _twin({k: (r,) for k, r in tips.items()}, "force")),
        f"learnt: {LABELLED} presses of 2 to 20 N, each weighed half-way up, at the top and "
        "half-way down",
        f"asked: {HELD_OUT} other presses and {PAIRS} pairs, seven forces each on the way up and "
        f"down, from 2 N to a top of 4 to 20 N; means of {FRAMES} frames",
        "tips of 8, 10 and 12 mm radius in the first seeds, 10, 12 and 8 in the others; the method "
        "knows neither, and was chosen on the first",
        "variation: of force over true force, over presses; cost: of a frame beyond the fit",
    )
    yield table(
        "depth of held-out presses on the twin's textile, 16 electrodes",
        (row for tips, labelled in DEPTHS for row in _twin(tips, "depth", labelled)),
        "as the forces above, with depths of 0.2 to 1.1 mm and a top from 0.3 mm on; the foam is "
        "3 mm thick and gives way by 1.2 at most",
        "tips: radii, one of which makes each press, taught and asked; the method knows none, and "
        "was chosen on seeds 11 to 13 and 31 to 33",
    )
    yield table(
        "dents on the twin's textile, 16 electrodes",
        (row for seed, radius in DENTS.items() for row in _dents(seed, radius)),
        f"{MAPS} maps each of 0.3 to 1.1 mm; one tip a sheet, whose size is not given, seeds "
        f"{', '.join(map(str, DENTS))}; without a map: rms of the dent; the dent: above 5 %",
        across="presses",
    )
    folder = available(data, "eskin_fingertip8", "eskin_hydrogel_round")
    if folder is None:
        return
    yield table(
        "a real fingertip",
        _fingertip(folder / "eskin_fingertip8" / "A2.npz"),
        "AmountProcess, which only Python offers, on eskin_fingertip8/A2; newtons presumably; the "
        "labels have steps of 0.01. The components that count were chosen by presses left out of "
        "the learning of fold 5",
    )
    yield table(
        "depth classes of a real hydrogel skin",
        _hydrogel(folder / "eskin_hydrogel_round"),
        "AmountProcess on eskin_hydrogel_round, 16 electrodes: 10, 15 and 20 mm of robot travel; "
        "the nearest class counts. Plain: a Gaussian process with one kernel on the changes, its "
        "three numbers by their likelihood",
    )


@dataclass(frozen=True)
class Shown:
    """One stage of a press: true amount, what was found of it if anything, the press, s."""

    amount: float
    detection: Detection | None
    press: int
    time: float


class Scale:
    """A twin whose presses are measured; each begins on a sheet that nothing has touched."""

    def __init__(self, seed: int, radii: Tips, of: str = "force", skin: str = SKIN) -> None:
        self.lab = TwinLab(skin, "textile", seed)
        self.random = np.random.default_rng(seed)
        self.radii, self.of = radii, of
        self.finder = self.lab.by_fit()

    def pressed(
        self, tops: Floats, steps: Sequence[float], number: int
    ) -> Iterator[tuple[float, list[Shown]]]:
        """Time s and what is shown of each of ``tops``, at every step of the way up and down."""
        lab = self.lab
        places = self._places(len(tops))
        radii = self.random.choice(self.radii, len(tops))
        lab.board.sheet.renew()
        self.finder.push(lab.shown(0 * lab.reference.mean))
        for step in steps:
            amounts = SPAN[self.of][0] + (tops - SPAN[self.of][0]) * step
            lab.board.sheet.set_presses(tuple(
                _press(lab, self.of, place, float(amount), float(r))
                for place, amount, r in zip(places, amounts, radii, strict=True)
            ))  # fmt: skip
            found = self.finder.push(lab.shown(self._volts() - lab.reference.mean))
            yield (
                lab.time,
                [
                    Shown(float(amount), _nearest(found, place), number, lab.time)
                    for amount, place in zip(amounts, places, strict=True)
                ],
            )

    def _volts(self) -> Floats:
        lab, total = self.lab, 0.0
        for _ in range(FRAMES):
            lab.time += BETWEEN
            total = total + lab.prepared.readout(lab.rig.at(lab.time)).values
        return np.asarray(total / FRAMES)

    def _places(self, count: int) -> Floats:
        while not far_apart(places := evenly(self.random, count, 0.085), APART):
            continue
        return places


def _press(lab: TwinLab, of: str, place: Sequence[float], amount: float, radius: float) -> Press:
    """What presses with that force, or to that depth."""
    x, y = map(float, place)
    if of == "force":
        return Press(x, y, amount, radius)
    one = lab.board.sheet.depth_under(Press(x, y, 1.0, radius))
    return Press(x, y, (amount / (MOST - amount)) / (one / (MOST - one)), radius)


def _nearest(found: Sequence[Detection], place: Floats) -> Detection | None:
    near = [d for d in found if gap(d, place) < NEAR]
    return min(near, key=lambda d: gap(d, place), default=None)


class Weighed(NamedTuple):
    """Of all presses: mean relative error, part in the intervals, deviation over the spots of each
    press's mean ratio, how many were not found, ms of a frame."""

    error: float
    inside: float
    variation: float
    missed: int
    cost: float


def calibrated(scale: Scale, labelled: int = LABELLED) -> AmountModel:
    """Learnt from labelled presses."""
    least, most = SPAN[scale.of]
    tops = least + (most - least) * (np.arange(labelled) * 0.618 % 1)
    shown = [
        one
        for number, top in enumerate(tops)
        for _, stage in scale.pressed(np.array([top]), STAGES, number)
        for one in stage
        if one.detection is not None
    ]
    presses = LabelledPresses.of(
        [one.detection for one in shown],
        *(np.array([getattr(one, key) for one in shown]) for key in ("amount", "press", "time")),
        scale.of,
    )
    return AmountModel.fit(presses, scale.lab.prepared.skin)


def _weighed(scale: Scale, model: AmountModel, count: int, presses: int) -> Weighed:
    ratio = np.full((presses, count, len(LOOP)), np.nan)
    held, taken = ratio.copy(), []
    for number in range(presses):
        least, most = SPAN[scale.of]
        tops, state = scale.random.uniform(least + (most - least) / 9, most, count), None
        for step, (now, stage) in enumerate(scale.pressed(tops, LOOP, number)):
            seen = [k for k, one in enumerate(stage) if one.detection is not None]
            began = time.process_time()
            amounts, state = model.read(state, [stage[k].detection for k in seen], now)
            taken.append(1e3 * (time.process_time() - began))
            for k, amount in zip(seen, amounts, strict=True):
                ratio[number, k, step] = amount.value / stage[k].amount
                held[number, k, step] = amount.low <= stage[k].amount <= amount.high
    ratio = ratio.reshape(-1, len(LOOP))
    wrong, spots = np.abs(ratio - 1), np.nanmean(ratio, axis=1)
    missed, cost = int(np.isnan(ratio).sum()), float(np.median(taken))
    return Weighed(np.nanmean(wrong), np.nanmean(held), np.nanstd(spots), missed, cost)


def _dents(seed: int, radius: float) -> Iterator[dict[str, Any]]:
    """Maps of one to three presses against the twin's own dents, on its mesh."""
    scale = Scale(seed, (radius,), "depth", "layer 16")
    model, sheet = calibrated(scale, LABELLED // 2), scale.lab.board.sheet
    points, area = sheet.model.mesh.centroids, sheet.model.mesh.volumes
    for count in (1, 2, 3):
        figures = []
        for number in range(MAPS):
            tops, state = scale.random.uniform(0.3e-3, 1.1e-3, count), None
            for now, stage in scale.pressed(tops, (0.3, 1.0), number):
                found = [one.detection for one in stage if one.detection is not None]
                amounts, state = model.read(state, found, now)
            touches = [replace(d, depth=a) for d, a in zip(found, amounts, strict=True)]
            dent, true = dent_map(touches, points, scale.lab.skin.layer), sheet.load[3]
            off, deep = dent.deflection - true, area * (true > true.max() / 20)
            held = np.abs(off) <= 1.64 * dent.deviation
            sizes = [np.sqrt(np.average(v**2, weights=area)) / true.max() for v in (off, true)]
            figures.append([*sizes, *(np.average(held, weights=w) for w in (area, deep))])
        names = "rms of the greatest depth", "without a map", "within 1.64 sd", "in the dent alone"
        parts = map(_percent, np.mean(figures, axis=0))
        yield {"tip mm": 1e3 * radius, "presses": count} | dict(zip(names, parts, strict=True))


def _twin(tips: Mapping[int, Tips], of: str, labelled: int = LABELLED) -> Iterator[dict[str, Any]]:
    by_count: dict[int, list[Weighed]] = {1: [], 2: []}
    left_out = []
    for seed, radii in tips.items():
        scale = Scale(seed, radii, of)
        model = calibrated(scale, labelled)
        left_out.append(np.abs(model.errors).mean())
        for (count, some), presses in zip(by_count.items(), (HELD_OUT, PAIRS), strict=True):
            some.append(_weighed(scale, model, count, presses))
    for contacts, some in by_count.items():
        yield {
            "contacts": contacts,
            "seeds": ", ".join(map(str, tips)),
            "tips mm": ", ".join(
                f"{1e3 * min(r):.0f} to {1e3 * max(r):.0f}" for r in tips.values()
            ),
            "labelled": labelled,
            "each": ", ".join(_percent(w.error) for w in some),
            "mean error": _percent(np.mean([w.error for w in some])),
            "in 90 % interval": _percent(np.mean([w.inside for w in some])),
            "variation over the skin": round(float(np.mean([w.variation for w in some])), 3),
            "by labels left out": _percent(np.mean(left_out)),
            "not found": sum(w.missed for w in some),
            "cost, ms": round(float(np.median([w.cost for w in some])), 3),
        }


def _bound(of: str) -> Iterator[dict[str, Any]]:
    """Relative deviations of an amount: radius unknown, from 8 to 12 mm, and known."""
    lab, (radii, amounts) = TwinLab(SKIN, "ideal", min(SETS[0])), BOUNDS[of]
    for x, radius, amount in product((0.02, 0.05, 0.075), radii, amounts):
        more, less = (
            [_press(lab, of, (x, 0.0), amount * a, radius * b).force for a, b in ((e, 1), (1, e))]
            for e in (1.05, 1 / 1.05)
        )
        turn = np.eye(4)  # of the force and radius that a step of the amount, or radius, takes
        turn[2, 2:] = np.log(np.divide(more, less)) / np.log(1.05**2)
        information = lab.information(_press(lab, of, (x, 0.0), amount, radius))
        information = turn.T @ information @ turn
        usual = information + np.diag([0, 0, 0, (0.05 / 0.117) ** 2])  # of log radius
        some = {"tip unknown": information, "8 to 12 mm": usual, "tip known": information[:3, :3]}
        if of == "force":
            del some["8 to 12 mm"]
        parts = {k: 0.05 * float(np.sqrt(np.linalg.inv(v)[2, 2])) for k, v in some.items()}
        case = {"from the middle mm": 1e3 * x, "tip radius mm": 1e3 * radius}
        case |= {"force N": amount} if of == "force" else {"depth mm": 1e3 * amount}
        yield case | {name: _percent(part) for name, part in parts.items()}


def _fingertip(path: Path) -> Iterator[dict[str, Any]]:
    with np.load(path) as kept:
        before, during, force, row = (
            kept[key].astype(float) for key in ("before", "during", "force", "row")
        )
    order = np.arange(len(force)) / len(force)
    tests = {f"every tenth row, {fold} of 10": row % 10 == fold for fold in FOLDS}
    tests |= {name: (order >= low) & (order < high) for name, (low, high) in BLOCKS.items()}
    for name, test in tests.items():
        model = AmountProcess.fit(before[~test], during[~test], force[~test])
        found, low, high = model.predict(before[test], during[test])
        true = force[test]
        yield {
            "rows left out": name,
            "presses": int(test.sum()),
            "mean error N": round(float(np.abs(found - true).mean()), 4),
            "always the mean": round(float(np.abs(force[~test].mean() - true).mean()), 4),
            "in 90 % interval": _percent(((low <= true) & (true <= high)).mean()),
            "by presses left out": round(float(np.abs(model.left_out - force[~test]).mean()), 4),
        }


def _hydrogel(folder: Path) -> Iterator[dict[str, Any]]:
    for name in ("round16_single550", "round16_single500_ohmc"):
        with np.load(folder / f"{name}.npz") as kept:
            rest, pressed, depth = (kept[k].astype(float) for k in ("v_up", "v_down", "depth_mm"))
        order = np.arange(len(depth)) / len(depth)
        tests = {"the last tenth": order >= 0.9, "every tenth": np.arange(len(depth)) % 10 == 5}
        for rows, test in tests.items():
            model = AmountProcess.fit(rest[~test], pressed[~test], depth[~test])
            ours = model.predict(rest[test], pressed[test])
            change = pressed - rest
            plain = _plain(change[~test], depth[~test], change[test])
            row = {"recording, left out": f"{name}, {rows}", "presses": int(test.sum())}
            for method, (found, low, high) in {"": ours, "plain: ": plain}.items():
                levels = np.unique(depth)
                nearest = levels[np.abs(found[:, None] - levels).argmin(axis=1)]
                held = (low <= depth[test]) & (depth[test] <= high)
                row |= {
                    f"{method}class right": _percent((nearest == depth[test]).mean()),
                    f"{method}error mm": round(float(np.abs(found - depth[test]).mean()), 2),
                    f"{method}in 90 % interval": _percent(held.mean()),
                }
            yield row


def _plain(data: Floats, labels: Floats, asked: Floats) -> tuple[Floats, Floats, Floats]:
    """Mean, 5 % and 95 % point of a Gaussian process with one kernel."""
    scale = data.std(axis=0)
    own, cross = (cdist(one / scale, data / scale, "sqeuclidean") for one in (data, asked))
    rest = labels - labels.mean()

    def parts(logs: Floats) -> tuple[Floats, Floats]:
        size, length, noise = np.exp(logs)
        return size * np.exp(-own / (2 * length)) + noise * np.eye(len(own)), size * np.exp(
            -cross / (2 * length)
        )

    def unlikely(logs: Floats) -> float:
        lower = np.linalg.cholesky(parts(logs)[0])
        return float(0.5 * (np.linalg.solve(lower, rest) ** 2).sum() + np.log(np.diag(lower)).sum())

    first = np.log([rest.var(), np.median(own), rest.var() / 10])
    logs = minimize(unlikely, first, method="Nelder-Mead", options={"maxiter": 200}).x
    covariance, near = parts(logs)
    weights = np.linalg.solve(covariance, near.T)
    variance = np.exp(logs[0]) + np.exp(logs[2]) - (near * weights.T).sum(axis=1)
    middle, half = labels.mean() + weights.T @ rest, 1.645 * np.sqrt(variance)
    return middle, middle - half, middle + half


def _percent(part: float) -> str:
    return f"{100 * part:.1f} %" if part < 0.2 else f"{100 * part:.0f} %"
