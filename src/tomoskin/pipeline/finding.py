"""Image and difference data → detections: regions of the image, or touches fitted to the data."""

from __future__ import annotations

from collections.abc import Callable, Generator
from dataclasses import dataclass, replace
from functools import partial
from typing import Self

import numpy as np

from tomoskin.core import Detection, FloatArray, finished
from tomoskin.learning import FrameView, TouchFit
from tomoskin.pipeline.diagnosis import Cause, Diagnosis, likeliest
from tomoskin.pipeline.frame_result import ModelAgreement
from tomoskin.pipeline.frame_subspace import JUMP
from tomoskin.pipeline.prepare import Prepared
from tomoskin.sensing.fit import (
    EXHAUSTIVE,
    Deformation,
    Pace,
    SpotFinder,
    SpotModel,
    common_mode_variance,
    idle_covariance,
    measured_covariance,
)
from tomoskin.sensing.signal import Reference

_PRESSES = replace(EXHAUSTIVE, joint=0, rounds=0)
"""Of frames that hold one press each, which have nothing to do with each other."""


class RegionFinder:
    """Touches are regions of the image."""

    like_touch = rises = False
    deformation: Deformation | None = None
    moved: FloatArray | None = None
    others: FloatArray | None = None
    problem: Diagnosis | None = None

    def __init__(self, prepared: Prepared) -> None:
        self._segmenter = prepared.segmenter

    def renewing(self, prepared: Prepared, reference: Reference | None) -> FinderSteps:
        """What goes on with another operator or noise."""
        del reference
        yield from ()
        return lambda: RegionFinder(prepared)

    def foresee(self, nuisance: FloatArray, jumps: FloatArray) -> None:
        """Nothing is made for these."""

    def push(self, view: FrameView) -> list[Detection]:
        """Detections of a frame, strongest first."""
        return self._segmenter(view.image, view.image_noise())

    def learn(self, *, touched: bool) -> bool:
        """Nothing is learnt of the newest frame, and what touches have left shows in images."""
        del touched
        return False


class FitFinder:
    """Touches are fitted to the data themselves; a filter over frames does not enter.

    Attributes
    ----------
    model, spots
        The sheet on which touches are fitted, and what fits them.
    volts
        Ratio of measured and modelled voltages.
    like_touch
        Whether the newest frame may hold a touch, though none was found.
    rises
        Whether the newest frames show a change of the sign that touches do not have.
    problem
        What is likely wrong with the newest frame, or None.
    """

    def __init__(
        self, model: SpotModel, spots: SpotFinder, volts: float, pace: Pace, interval: float
    ) -> None:
        self.model, self.like_touch, self.rises = model, False, False
        self.problem: Diagnosis | None = None
        self.spots, self.volts, self._pace, self._interval = spots, volts, pace, interval

    @classmethod
    def making(
        cls,
        model: SpotModel,
        prepared: Prepared,
        reference: Reference | None,
        pace: Pace = EXHAUSTIVE,
        interval: float = np.nan,
    ) -> Generator[None, None, Self]:
        """On the sheet of ``model``, a piece of work between two yields.

        ``interval`` s between frames, by the board's own clock: a scan takes no longer. NaN where
        it is not known: then both last as long as on the slowest board.
        """
        gain = _gain(model, prepared, reference)
        noise = yield from _noise(prepared, reference, gain)
        skin = prepared.skin
        between = interval if interval > 0 else prepared.longest_scan
        scan_time = min(prepared.longest_scan, between)
        spots = SpotFinder(
            model, skin, prepared.mesh, noise, gain,
            pace=replace(pace, scan_time=scan_time, interval=between),
        )  # fmt: skip
        return cls(model, spots, _voltage_ratio(model, reference), pace, interval)

    def renewing(self, prepared: Prepared, reference: Reference | None) -> FinderSteps:
        """What goes on with another operator or noise; on another sheet it begins anew."""
        if prepared.spots is None or prepared.spots is self.model:
            gain = _gain(self.model, prepared, reference)
            noise = yield from _noise(prepared, reference, gain)
            adopt = yield from self.spots.renewing(noise, gain)
            return partial(self._renewed, adopt, _voltage_ratio(self.model, reference))
        other = yield from FitFinder.making(
            prepared.spots, prepared, reference, self._pace, self._interval
        )
        go_on = yield from other.spots.preparing(self.spots)
        return partial(other._renewed, go_on, other.volts)

    def _renewed(self, adopt: Callable[[], None], volts: float) -> FitFinder:
        adopt()
        self.volts = volts
        return self

    def foresee(self, nuisance: FloatArray, jumps: FloatArray) -> None:
        """Make what the first frame is seen by, which takes half a second for 32 electrodes."""
        self.spots.foresee(nuisance, jumps)

    def push(self, view: FrameView) -> list[Detection]:
        """Detections of a frame, strongest first."""
        differences, spots, watch = view.differences, self.spots, self.spots.watch
        detections = spots.push(
            differences.whole, differences.unknown, differences.jumps, differences.wander
        )
        jump = spots.jump
        self.like_touch, self.rises = watch.like_touch or jump is not None, watch.rises
        texts = {
            Cause.STEP: None if jump is None else _jump_text(JUMP * jump),
            Cause.REFERENCE: watch.lifted_problem,
            Cause.NOISE: watch.noise_problem,
        }
        self.problem = likeliest(Diagnosis(cause, text) for cause, text in texts.items() if text)
        return detections

    def learn(self, *, touched: bool) -> bool:
        """See :meth:`SpotFinder.learn`; whether what touches have left does not show any more."""
        self.spots.learn(touched=touched)
        return not touched

    def strongest(self, dv: FloatArray) -> Detection | None:
        """The strongest touch in difference data (n_meas,), NaN where a value is missing."""
        lost = ~np.isfinite(dv)
        if lost.all():
            return None
        detections = self.spots.push(np.where(lost, 0.0, dv), np.eye(len(dv))[:, lost])
        return detections[0] if detections else None

    @property
    def deformation(self) -> Deformation | None:
        """How the sheet is deformed as a whole in the newest frame; None where it is at rest."""
        return self.spots.deforming.told

    @property
    def moved(self) -> FloatArray | None:
        """(n_meas,) of difference data that this has moved them by, or None."""
        return self.spots.moved

    @property
    def others(self) -> FloatArray:
        """(k, n_meas) V: for each detection of the newest frame what all others change."""
        return self.volts * self.spots.others()


Finder = RegionFinder | FitFinder
"""What finds the touches of one frame after the other."""

FinderSteps = Generator[None, None, Callable[[], Finder]]
"""Pieces of work, each of a millisecond or less where measurements are few, that lead to what makes
the finder of the next frame. They change nothing that frames read meanwhile."""


def _jump_text(part: float) -> str:
    return (
        f"all voltages have changed by {100 * part:+.2g} % at once: gain or supply, and no touch; "
        "check current, supply and cables"
    )


def located_alone(prepared: Prepared, agreement: ModelAgreement) -> bool:
    """Whether a calibration locates touches without a fit.

    Voltages that the skin's model does not know are no ground for a fit, but labels are.
    """
    locates = any(c.kind.locates for c in prepared.calibrations.values())
    return locates and agreement.doubt(volts=True) is not None


def finder_of(
    prepared: Prepared,
    reference: Reference | None,
    pace: Pace = EXHAUSTIVE,
    interval: float = np.nan,
    *,
    fitted: bool = True,
) -> Finder:
    """What finds the touches: the method that the skin names.

    ``pace`` says how much of a fit is tried in a frame; ``interval`` s between frames, or NaN;
    ``fitted``: whether the voltages are those of the skin's model, so that a fit is possible.
    """
    if prepared.spots is None or prepared.skin.touch.method != "fit" or not fitted:
        return RegionFinder(prepared)
    return finished(FitFinder.making(prepared.spots, prepared, reference, pace, interval))


@dataclass(frozen=True, eq=False)
class FitConditions:
    """Conditions under which calibrations are applied: touches can be fitted beside them.

    Attributes
    ----------
    prepared, reference
        The skin, and what it reads while nothing touches it, where that is known.
    fitted
        Whether detections are touches that were fitted to the data.
    interval
        Between frames, s, or NaN.
    unrelated
        Whether frames are no course in time.
    """

    prepared: Prepared
    reference: Reference | None
    fitted: bool
    interval: float = np.nan
    unrelated: bool = False

    def fitted_presses(self, dv: FloatArray) -> list[Detection | None] | None:
        """See :class:`tomoskin.learning.Conditions`."""
        prepared, model, reference = self.prepared, self.prepared.spots, self.reference
        if not self.fitted or model is None:
            return None
        mean = prepared.operator.reference if reference is None else reference.mean
        is_plain = prepared.operator.difference == "plain"
        data = dv if is_plain else dv / np.abs(mean)
        finder = finished(FitFinder.making(model, prepared, reference, _PRESSES))
        return [finder.strongest(frame) for frame in data]

    def touch_fit(self) -> TouchFit | None:
        """See :class:`tomoskin.learning.Conditions`."""
        prepared, reference = self.prepared, self.reference
        if reference is None or prepared.spots is None:
            return None
        model = prepared.spots
        gain = _voltage_ratio(model, reference)
        if self.fitted:
            return TouchFit(model.response, gain, lambda _, detections: detections)
        finder = finished(FitFinder.making(model, prepared, reference, interval=self.interval))
        return TouchFit(model.response, gain, lambda view, _: finder.push(view))


def fit_conditions(prepared: Prepared, reference: Reference | None) -> FitConditions:
    """Conditions of a skin that reads as ``reference`` while nothing touches it."""
    method = prepared.skin.touch.method == "fit" and prepared.spots is not None
    if reference is None or not method:
        return FitConditions(prepared, reference, fitted=False)
    agreement = ModelAgreement.of(reference.mean, prepared.operator.reference)
    return FitConditions(prepared, reference, fitted=agreement.doubt(volts=True) is None)


def voltage_covariance(prepared: Prepared, reference: Reference | None) -> FloatArray:
    """(n_meas, n_meas) V² of one frame less the reference."""
    return finished(_voltage_covariance(prepared, reference, 1.0))


def _voltage_covariance(
    prepared: Prepared, reference: Reference | None, gain: float
) -> Generator[None, None, FloatArray]:
    """``gain`` of what is predicted."""
    readout, scan = prepared.readout, prepared.scan
    oversampling = prepared.skin.readout.oversampling
    step = abs(gain) * readout.volts_per_count * oversampling
    if reference is not None and reference.scatter is not None:
        return (
            yield from idle_covariance(
                scan,
                reference.scatter,
                least=reference.least,
                step=step,
                oversampling=oversampling,
                signatures=None if prepared.spots is None else prepared.spots.candidates.signatures,
            )
        )
    return measured_covariance(
        scan,
        np.full(prepared.pattern.n_meas, np.nan) if reference is None else reference.noise,
        1 if reference is None else reference.n_frames,
        predicted=abs(gain) * readout.noise,
        step=step,
        oversampling=oversampling,
    )


def _noise(
    prepared: Prepared, reference: Reference | None, gain: float
) -> Generator[None, None, FloatArray]:
    """(n_meas, n_meas) covariance of difference data: one frame less the reference."""
    volts = yield from _voltage_covariance(prepared, reference, gain)
    if reference is not None and prepared.skin.signal.common_modes == "projected":
        variance = common_mode_variance(volts, reference)
        volts = volts + variance * np.outer(reference.mean, reference.mean)
    if prepared.operator.difference == "plain":
        return volts
    size = np.abs(prepared.operator.reference if reference is None else reference.mean)
    return np.asarray(volts / size[:, None] / size)


def _gain(model: SpotModel, prepared: Prepared, reference: Reference | None) -> float:
    """Ratio of measured and modelled voltages, which a change has too; 1 for ratios."""
    if prepared.operator.difference == "normalised":
        return 1.0
    return _voltage_ratio(model, reference)


def _voltage_ratio(model: SpotModel, reference: Reference | None) -> float:
    """Ratio of measured and modelled voltages; 1 where nothing was measured."""
    if reference is None:
        return 1.0
    modelled = model.response.reference
    return float(reference.mean @ modelled / (modelled @ modelled))
