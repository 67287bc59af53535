"""The kinds of calibration that tell the force and the depth of touches, from labelled presses; and
what their model says of itself."""

from __future__ import annotations

from dataclasses import asdict, replace
from typing import Any

import numpy as np

from tomoskin.core import MEASURANDS, DataError, Detection, FloatArray
from tomoskin.learning.amount.amount_model import AmountModel, PressedSpots
from tomoskin.learning.amount.curve import basis
from tomoskin.learning.amount.measurand import MEASURED
from tomoskin.learning.kind import Applied, Calibration, Conditions, FrameView, Kind
from tomoskin.model.skin import Skin


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
