"""The kind of calibration that tells the force of touches, from presses with known weights."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from tomoskin.core import DataError, Detection, IntArray
from tomoskin.learning.force.model import ForceModel, PressedSpots
from tomoskin.learning.kind import Applied, Calibration, Conditions, FrameView, Kind
from tomoskin.model.skin import Skin


class ForceApplied(Applied):
    """Gives each touch its force; what the pressed spots remember goes from frame to frame."""

    def __init__(self, model: ForceModel) -> None:
        self._model = model
        self._spots: PressedSpots | None = None

    def locate(self, view: FrameView, detections: list[Detection]) -> list[Detection]:
        """The same detections, with forces."""
        forces, self._spots = self._model.read(self._spots, detections, view.time)
        return [
            replace(detection, force=force)
            for detection, force in zip(detections, forces, strict=True)
        ]


def _check(calibration: Calibration[ForceModel], skin: Skin) -> None:
    """Forces rest on the sheet and on how touches are found on it, not on its images."""
    model = calibration.model
    if skin.touch.method != model.method:
        raise DataError(
            f'the calibration of forces needs touches found by method "{model.method}", but this '
            f'skin\'s method is "{skin.touch.method}"',
            where="[touch] method",
            hint=f'set method = "{model.method}" in the skin file, or calibrate again: '
            "tomoskin calibrate force",
        )
    if not np.isclose(skin.conductivity, model.conductivity, rtol=1e-6):
        raise calibration.mismatch("sheet", skin)


def _exclude(model: ForceModel, _measurements: IntArray) -> ForceModel:
    """Touches found without some measurements are touches all the same."""
    return model


def _apply(model: ForceModel, conditions: Conditions) -> Applied:
    """Regions of an image have other peaks and areas than fitted touches: they get no force."""
    is_like = conditions.fitted == (model.method == "fit")
    return ForceApplied(model) if is_like else Applied()


FORCE = Kind(
    name="force",
    title="tomoskin force calibration",
    subject="forces",
    attachment="force.npz",
    learn=ForceModel.learn,
    check=_check,
    exclude=_exclude,
    apply=_apply,
)
"""Forces of touches from known weights; its model is a :class:`ForceModel`."""
