"""Touches of known force, or depth → that of a touch, with an interval, frame by frame; what such a
model says of itself, and the kinds of calibration that it makes."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from functools import cached_property
from typing import Any, Self

import numpy as np

from tomoskin.core import MEASURANDS, Amount, DataError, Detection, FloatArray, IntArray
from tomoskin.learning.amount.curve import (
    SHALLOW,
    AmountCurve,
    averaged_memory,
    basis,
    without_memory,
)
from tomoskin.learning.amount.measurand import (
    MEASURED,
    LabelledPresses,
    check_rising,
    columns_of,
)
from tomoskin.learning.kind import Applied, Calibration, Conditions, FrameView, Kind
from tomoskin.learning.touch.gaussian_process import nine_in_ten
from tomoskin.model.skin import MaterialMemory, MemoryState, Skin, advanced, load_of
from tomoskin.sensing.segment import Region

_DEEPEST = 0.999
"""Part of the conductivity that a touch may take away: all of it has no logarithm."""

_SCALES = (1.0, 1.6)
"""By which intervals are widened; never narrowed, since the labels of a press go together."""

_LONELY = 0.15
"""Presses within so many radii of the skin are of one spot."""

_FAR_OFF = 4.0
"""A label so many half intervals from what the others say contradicts them."""

_MOST_SPOTS = 32


@dataclass(frozen=True)
class LabelRemark:
    """A ``press`` by its number, or None for all, and what is wrong with it."""

    press: int | None
    reason: str


@dataclass(frozen=True, eq=False)
class PressedSpots:
    """What spots of the skin remember: ``xy`` (n, 2) m, ``memory`` of n pieces at ``time`` s."""

    xy: FloatArray
    time: float
    memory: MemoryState

    def __len__(self) -> int:
        """The number of spots that are pressed."""
        return len(self.xy)


@dataclass(frozen=True, eq=False)
class AmountModel:
    """Force or depth of touches on one skin, for tips like those taught; made by :meth:`fit`.

    Attributes
    ----------
    presses
        What it was learnt from.
    conductivity
        S of the sheet at rest.
    unit, radius
        Radius of the skin's region, and usual radius of the labelled touches, m.
    depth
        Usual depth of the labelled touches.
    memory
        What the sheet remembers, in the unit of a touch's depth.
    curve
        Depth and amount.
    scale
        By which intervals are widened, so that nine in ten of the labels lie in theirs when
        their press is left out.
    left_out
        (n_labelled, 3) amount, 5 % and 95 % point of each label, its press left out, SI.
    remarks
        What is wrong with labels.
    skin_id, method
        Identity of the skin; how its touches were found.
    """

    presses: LabelledPresses
    conductivity: float
    unit: float
    radius: float
    depth: float
    memory: MaterialMemory
    curve: AmountCurve
    scale: float
    left_out: FloatArray
    remarks: tuple[LabelRemark, ...]
    skin_id: str = ""
    method: str = "fit"

    @classmethod
    def fit(cls, presses: LabelledPresses, skin: Skin) -> Self:
        """Learn from presses on ``skin``; see :meth:`learn`. Raises DataError for a depth beyond
        its layer too."""
        if skin.layer is not None:
            presses.check_within(skin.layer)
        unit = Region.of(skin).unit
        return cls.learn(presses, skin.conductivity, unit, skin.identity, skin.touch.method)

    @classmethod
    def learn(
        cls,
        presses: LabelledPresses,
        conductivity: float,
        unit: float,
        skin_id: str = "",
        method: str = "fit",
    ) -> Self:
        """Learn curve and memory from presses on a sheet of ``conductivity`` S, ``unit`` m.

        The memory is a mean over several plays and creeps, weighted by the labels' evidence.

        Raises
        ------
        DataError
            When labels contradict, or a labelled touch makes the sheet conduct better.
        """
        if not (conductivity > 0 and unit > 0):
            raise DataError(
                f"expected a conductivity and a unit above 0, got {conductivity} and {unit}"
            )
        rows, of = presses.labelled, presses.of_what
        radius = float(np.exp(np.log(_radius(presses.area[rows])).mean()))
        depth = depth_of(presses.peak, presses.area, conductivity, radius)
        if not (depth[rows] > 0).all():
            row = int(rows[np.argmin(depth[rows])])
            raise DataError(
                f"press {presses.press[row]}, with {of.text(presses.amount[row])}, increases the "
                "conductivity of the sheet",
                where=of.where,
                hint="calibrate with frames in which the press is found as a touch",
            )
        check_rising(of, depth[rows], presses.amount[rows])
        terms = basis(presses.xy, np.log(_radius(presses.area) / radius), unit)
        usual = float(np.median(depth[rows]))
        memory = averaged_memory(presses, depth, usual, terms)
        free = without_memory(memory, depth[:, None], presses.press, presses.time)[:, 0]
        free = np.maximum(free, SHALLOW * usual)
        curve = AmountCurve.of(of, terms[rows], free[rows], presses.amount[rows])
        left_out = _left_out(presses, terms, free)
        needed = nine_in_ten(_half_intervals(left_out, presses.amount[rows]))
        scale = float(np.clip(needed, *_SCALES))
        remarks = _remarks(presses, left_out, unit)
        return cls(
            presses, conductivity, unit, radius, usual, memory, curve, scale, left_out, remarks,
            skin_id, method,
        )  # fmt: skip

    def read(
        self, spots: PressedSpots | None, detections: Sequence[Detection], time: float
    ) -> tuple[list[Amount], PressedSpots]:
        """Amounts of a frame's detections, and what the spots remember then.

        ``spots`` is what they remembered after the frame before, None on a skin that nothing has
        touched; ``time`` is the frame's, s. A spot that is new has been pressed since that frame.
        """
        spots = spots or PressedSpots(np.zeros((0, 2)), -np.inf, MemoryState.fresh(self.memory, 0))
        dt = max(time - spots.time, 0.0) if len(spots) else 0.0
        if not detections:
            released = self._released(spots, np.arange(len(spots)), dt)
            return [], PressedSpots(spots.xy, time, released)
        xy, area, peak, snr = columns_of(detections)
        least = SHALLOW * self.depth
        depth = np.maximum(depth_of(peak, area, self.conductivity, self.radius), least)
        under, rest = _goes_on(spots.xy, xy, 0.5 * self.radius)
        before = spots.memory
        if under != list(range(len(spots))):
            before = before.joined(MemoryState.fresh(self.memory)).of_pieces(np.array(under))
        load, now = load_of(before, self.memory, depth, dt)
        terms = basis(xy, np.log(_radius(area) / self.radius), self.unit)
        amounts = self._amounts(terms, np.maximum(load, least), self._beyond(snr))
        if rest:
            others = np.array(rest[: max(_MOST_SPOTS - len(xy), 0)], dtype=np.intp)
            now = now.joined(self._released(spots, others, dt))
            xy = np.concatenate([xy, spots.xy[others]])
        return amounts, PressedSpots(xy, time, now)

    def _released(self, spots: PressedSpots, which: IntArray, dt: float) -> MemoryState:
        """What those of ``spots`` that nothing touches remember ``dt`` s later."""
        memory = spots.memory.of_pieces(which)
        return advanced(memory, self.memory, np.zeros((1, len(which))), dt)

    @property
    def errors(self) -> FloatArray:
        """(n_labelled,) relative errors of the labels, each press left out."""
        amount = self.presses.amount[self.presses.labelled]
        return np.asarray(self.left_out[:, 0] / amount - 1)

    @cached_property
    def most(self) -> float:
        """The largest amount that it was learnt from; of more it says only that it is more."""
        return float(np.nanmax(self.presses.amount))

    @property
    def held(self) -> float:
        """Part of the labels within their own intervals, each press left out."""
        amount = self.presses.amount[self.presses.labelled]
        _, low, high = _widened(np.log(self.left_out), self.scale).T
        return float(((low <= amount) & (amount <= high)).mean())

    def _beyond(self, snr: FloatArray) -> FloatArray:
        """Relative deviation of depths by noise, beyond that of the labelled touches."""
        own = np.where(snr > 0, 1 / np.square(snr), 0.0)
        return np.sqrt(np.maximum(own - self._usual_noise, 0.0))

    @cached_property
    def _usual_noise(self) -> float:
        """Relative variance of the labelled touches by noise; 0 where it is not known."""
        known = self.presses.snr[self.presses.labelled]
        return float(np.nanmedian(1 / known**2)) if np.isfinite(known).any() else 0.0

    def _amounts(self, terms: FloatArray, depth: FloatArray, sd: FloatArray) -> list[Amount]:
        points = _widened(self.curve.log_amounts(terms, depth, sd), self.scale).tolist()
        most = self.most
        return [
            Amount(value, min(low, most), math.inf if value > most else high)
            for value, low, high in points
        ]


def depth_of(peak: FloatArray, area: FloatArray, conductivity: float, radius: float) -> FloatArray:
    """(n,) content of touches over ``radius``²: −log σ/σ₀ of one of that radius, m²/m²."""
    part = np.maximum(np.asarray(peak) / conductivity, -_DEEPEST)
    return np.asarray(-np.log1p(part) * np.asarray(area) / (np.pi * radius**2))


def _left_out(presses: LabelledPresses, terms: FloatArray, free: FloatArray) -> FloatArray:
    """(n_labelled, 3) amount and interval of each label from the other presses."""
    rows, of = presses.labelled, presses.of_what
    out = np.empty((len(rows), 3))
    for number in np.unique(presses.press[rows]):
        mine = presses.press[rows] == number
        others, own = rows[~mine], rows[mine]
        if not len(others):
            raise DataError(
                f"expected labelled {of.plural} of at least two presses, got one press",
                where=of.where,
                hint="lift the tip between two presses, or give the presses their own numbers",
            )
        curve = AmountCurve.of(of, terms[others], free[others], presses.amount[others])
        out[mine] = np.exp(curve.log_amounts(terms[own], free[own], np.zeros(len(own))))
    return out


def _half_intervals(left_out: FloatArray, amount: FloatArray) -> FloatArray:
    """(n,) by how many half intervals, on the side where it lies, each amount is missed."""
    middle, low, high = np.log(left_out).T
    away = np.log(amount) - middle
    return np.asarray(np.abs(away) / np.where(away > 0, high - middle, middle - low))


def _widened(logs: FloatArray, scale: float) -> FloatArray:
    """(n, 3) amounts whose intervals are ``scale`` times as wide as those of ``logs``."""
    middle = logs[:, :1]
    return np.asarray(np.exp(middle + scale * (logs - middle)))


def _remarks(
    presses: LabelledPresses, left_out: FloatArray, unit: float
) -> tuple[LabelRemark, ...]:
    rows, of = presses.labelled, presses.of_what
    amount = presses.amount[rows]
    remarks = [
        LabelRemark(
            int(presses.press[row]),
            f"the label {of.text(presses.amount[row])} contradicts the other presses, which give "
            f"{of.text(middle, 2)} ({of.text(low, 2)} to {of.text(high, 2)})",
        )
        for row, (middle, low, high), away in zip(
            rows.tolist(), left_out.tolist(), _half_intervals(left_out, amount), strict=True
        )
        if away > _FAR_OFF
    ]
    xy = presses.xy[rows]
    apart = float(np.linalg.norm(xy - xy.mean(axis=0), axis=1).max())
    if apart < _LONELY * unit:
        remarks.append(LabelRemark(
            None,
            f"all presses lie within {2e3 * apart:.0f} mm: elsewhere {of.plural} are less certain, "
            "and their intervals are wider; press at other positions too",
        ))  # fmt: skip
    if np.ptp(np.log(amount)) < np.log(1.5):
        remarks.append(LabelRemark(
            None,
            f"all {of.plural} lie from {of.span(amount)}: others are extrapolated; press less and "
            "more too",
        ))  # fmt: skip
    return tuple(remarks)


def _goes_on(spots: FloatArray, xy: FloatArray, within: float) -> tuple[list[int], list[int]]:
    """Number of the spot that each of ``xy`` (k, 2) presses, -1 where it is a new one; numbers of
    the other ``spots`` (n, 2). The nearest counts, each once."""
    free, under = dict(enumerate(spots.tolist())), []
    for here in xy.tolist():
        apart = {k: math.dist(here, spot) for k, spot in free.items()}
        nearest = min(apart, key=apart.__getitem__, default=-1)
        under.append(nearest if nearest >= 0 and apart[nearest] <= within else -1)
        free.pop(under[-1], None)
    return under, list(free)


def _radius(area: FloatArray) -> FloatArray:
    return np.asarray(np.sqrt(np.maximum(area, 1e-12) / np.pi))


def report_of(model: AmountModel) -> dict[str, Any]:
    """How well labelled touches are measured, each with its press left out, by name.

    ``mean_error`` and ``median_error`` are relative, ``held_by_90_percent_intervals`` is a part,
    ``memory`` is whether the sheet was found to remember, ``text`` is for people.
    """
    presses, of = model.presses, model.presses.of_what
    errors, amount = np.abs(model.errors), presses.amount[presses.labelled]
    number, unit = len(np.unique(presses.press[presses.labelled])), MEASURANDS[of.name].lower()
    mean, median = float(errors.mean()), float(np.median(errors))
    return {
        "touches": len(errors),
        "presses": number,
        f"from_{unit}": float(amount.min()),
        f"to_{unit}": float(amount.max()),
        "mean_error": mean,
        "median_error": median,
        "held_by_90_percent_intervals": model.held,
        "memory": bool(model.memory.play),
        "remarks": [asdict(remark) for remark in model.remarks],
        "text": f"{len(errors)} touches of {number} presses, {of.span(amount)}; left out of the "
        f"learning their {of.plural} are missed by {100 * mean:.0f} % (median {100 * median:.0f} "
        f"%), and their 90 % intervals hold {100 * model.held:.0f} %",
    }


def least_known(model: AmountModel, xy: FloatArray) -> FloatArray:
    """(2,) m: that of the positions ``xy`` (n, 2) m at which a further press tells most.

    It is where the curve's level is least certain for a touch of the usual size.
    """
    curve = model.curve
    terms = basis(xy, np.zeros(len(xy)), model.unit)
    levels = terms @ curve.mean.T
    own = ((terms @ curve.covariance) * terms).sum(axis=2).T
    middle = levels @ curve.weight
    variance = (own + (levels - middle[:, None]) ** 2) @ curve.weight
    return np.asarray(xy[int(np.argmax(variance))])


class AmountApplied(Applied):
    """Gives each touch its amount; what the pressed spots remember goes from frame to frame."""

    def __init__(self, model: AmountModel) -> None:
        self._model = model
        self._name = model.presses.measurand
        self._spots: PressedSpots | None = None

    def locate(self, view: FrameView, detections: list[Detection]) -> list[Detection]:
        """The same detections, with amounts."""
        amounts, self._spots = self._model.read(self._spots, detections, view.time)
        named: list[dict[str, Any]] = [{self._name: amount} for amount in amounts]
        return [
            replace(detection, **amount)
            for detection, amount in zip(detections, named, strict=True)
        ]


def _check(calibration: Calibration[AmountModel], skin: Skin) -> None:
    """Amounts rest on the sheet and on how touches are found on it, not on its images."""
    model, kind = calibration.model, calibration.kind
    if skin.touch.method != model.method:
        raise DataError(
            f'the calibration of {kind.subject} needs touches found by method "{model.method}", '
            f'but this skin\'s method is "{skin.touch.method}"',
            where="[touch] method",
            hint=f'set method = "{model.method}" in the skin file, or calibrate again: '
            f"tomoskin calibrate {kind.name}",
        )
    if not np.isclose(skin.conductivity, model.conductivity, rtol=1e-6):
        raise calibration.mismatch("sheet", skin)


def _apply(model: AmountModel, conditions: Conditions) -> Applied:
    """Regions of an image have other peaks and areas than fitted touches: they get no amount."""
    is_like = conditions.fitted == (model.method == "fit")
    return AmountApplied(model) if is_like else Applied()


FORCE, DEPTH = (
    Kind(
        name=of.name,
        title=f"tomoskin {of.name} calibration",
        subject=of.plural,
        attachment=f"{of.name}.npz",
        learn=AmountModel.learn,
        check=_check,
        exclude=lambda model, _measurements: model,  # touches found without some are touches too
        apply=_apply,
    )
    for of in MEASURED.values()
)
"""Forces of touches from known weights, and depths from known travels of a tip; their models are
:class:`AmountModel`."""
