"""The kind of calibration that tells the force of touches, from presses with known weights; and
what its model says of itself."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from tomoskin.core import DataError, Detection, FloatArray, IntArray
from tomoskin.learning.force.curve import basis
from tomoskin.learning.force.force_model import ForceModel, LabelRemark, PressedSpots
from tomoskin.learning.kind import Applied, Calibration, Conditions, FrameView, Kind
from tomoskin.model.skin import Skin


@dataclass(frozen=True)
class ForceReport:
    """How well labelled touches are weighed, each with its press left out.

    Attributes
    ----------
    touches, presses
        How many were labelled.
    from_n, to_n
        Smallest and largest force, N.
    mean_error, median_error
        Relative errors of the forces.
    held
        Part of the forces that lie in their own 90 % intervals.
    memory
        Whether the sheet was found to remember.
    remarks
        What is wrong with labels.
    """

    touches: int
    presses: int
    from_n: float
    to_n: float
    mean_error: float
    median_error: float
    held: float
    memory: bool
    remarks: tuple[LabelRemark, ...]

    @classmethod
    def of(cls, model: ForceModel) -> ForceReport:
        """The report of a model that has learnt."""
        rows = model.presses.labelled
        errors, force = np.abs(model.errors), model.presses.force[rows]
        return cls(
            touches=len(rows),
            presses=len(np.unique(model.presses.press[rows])),
            from_n=float(force.min()),
            to_n=float(force.max()),
            mean_error=float(errors.mean()),
            median_error=float(np.median(errors)),
            held=model.held,
            memory=bool(model.memory.play),
            remarks=model.remarks,
        )

    @property
    def text(self) -> str:
        """The report as one sentence for people."""
        return (
            f"{self.touches} touches of {self.presses} presses, {self.from_n:.2g} to "
            f"{self.to_n:.2g} N; left out of the learning their forces are missed by "
            f"{100 * self.mean_error:.0f} % (median {100 * self.median_error:.0f} %), and "
            f"their 90 % intervals hold {100 * self.held:.0f} %"
        )


def least_known(model: ForceModel, xy: FloatArray) -> FloatArray:
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
