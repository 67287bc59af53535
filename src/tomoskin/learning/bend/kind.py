"""The kind of calibration that tells how the sheet is bent, from recorded bends.

Keys of the .npz: ``kind``, ``version``; ``dv`` (n, n_meas) V, ``angle_rad``, ``axis_rad``,
``time_s`` (n,); ``covariance`` (n_meas, n_meas) V²; ``drive``, ``measure`` (n_meas, 2),
``n_electrodes``; ``skin_name``. What was learnt is learnt again when it is read.
"""

from __future__ import annotations

from tomoskin.core import Arrays, DataError, Detection, real_numbers
from tomoskin.learning.bend.examples import BendExamples
from tomoskin.learning.bend.model import BendModel
from tomoskin.learning.bend.reader import BendReader, BendReading
from tomoskin.learning.kind import Applied, Conditions, FrameView, Kind, Progress, TouchFit, located
from tomoskin.model.pattern import Pattern

_LABELS = ("angle_rad", "axis_rad", "time_s")


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


def _pack(model: BendModel) -> Arrays:
    examples = model.examples
    labels = (examples.angle, examples.axis, examples.time)
    return {
        "dv": examples.dv,
        **dict(zip(_LABELS, labels, strict=True)),
        "covariance": model.covariance,
    }


def _unpack(arrays: Arrays, pattern: Pattern, where: str, _progress: Progress) -> BendModel:
    with located(where):
        dv, *labels, covariance = (
            real_numbers(arrays, key, where) for key in ("dv", *_LABELS, "covariance")
        )
        if covariance.shape != (pattern.n_meas,) * 2 or dv.shape[1:] != (pattern.n_meas,):
            raise DataError(
                f"expected {pattern.n_meas} rows of dv and covariance, "
                f"got shapes {dv.shape} and {covariance.shape}"
            )
        return BendModel.learn(BendExamples.of(dv, *labels), covariance)


def _apply(model: BendModel, conditions: Conditions) -> Applied:
    fit = conditions.touch_fit()
    return Applied() if fit is None else BendApplied(model, fit)


BENDS = Kind(
    name="bend",
    title="tomoskin bend calibration",
    version=1,
    subject="bends",
    command="bend",
    attachment="bends.npz",
    keys=frozenset({"dv", *_LABELS, "covariance"}),
    pack=_pack,
    unpack=_unpack,
    exclude=BendModel.without,
    apply=_apply,
    skin_id=lambda _model: "",
    directions=lambda model: model.directions,
    fits=True,
)
"""Bends of the sheet; its model is a :class:`BendModel`."""
