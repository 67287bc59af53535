"""The kind of calibration that tells how the sheet is bent, from recorded bends."""

from __future__ import annotations

from tomoskin.core import Detection
from tomoskin.learning.bend.model import BendModel
from tomoskin.learning.bend.reader import BendReader, BendReading
from tomoskin.learning.kind import Applied, Conditions, FrameView, Kind, TouchFit


class BendApplied(Applied):
    """Reads how the sheet is bent, beside the touches of each frame.

    An angle is told beside a touch only where what the touch changes is known, so that touches
    are fitted to the data here where the skin finds its own in the image.
    """

    def __init__(self, model: BendModel, fit: TouchFit) -> None:
        self._reader = BendReader(model, fit.response, fit.gain)
        self._detect = fit.detect

    def read(self, view: FrameView, detections: list[Detection], *, touched: bool) -> BendReading:
        """How the sheet is bent in this frame."""
        touches = self._detect(view, detections)
        data = view.differences
        reading = self._reader.push(data.change, touches, data.drift, view.time, touched=touched)
        self.moved = reading.moved
        return reading


def _apply(model: BendModel, conditions: Conditions) -> Applied:
    fit = conditions.touch_fit()
    return Applied() if fit is None else BendApplied(model, fit)


BENDS = Kind(
    name="bend",
    title="tomoskin bend calibration",
    subject="bends",
    attachment="bends.npz",
    learn=BendModel.learn,
    exclude=BendModel.without,
    apply=_apply,
    directions=lambda model: model.directions,
    fits=True,
)
"""Bends of the sheet; its model is a :class:`BendModel`."""
