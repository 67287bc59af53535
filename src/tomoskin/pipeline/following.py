"""The second state of the pipeline: each frame to its image, touches and what else was learnt."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from tomoskin.core import Detection, FloatArray, Image, ModelError, Touch, reach
from tomoskin.learning import Differences, FrameView
from tomoskin.model.pattern import Scan
from tomoskin.pipeline.collecting import Rest
from tomoskin.pipeline.conditioning import Conditioned, Conditioning, Followed, GivenDifferences
from tomoskin.pipeline.finding import (
    Finder,
    Finding,
    Fitting,
    InImage,
    finding,
    located_alone,
)
from tomoskin.pipeline.imaging import Filtered, SingleFrame, imaging
from tomoskin.pipeline.prepare import Prepared
from tomoskin.pipeline.records import FrameResult, Measured
from tomoskin.pipeline.tune import Steps, tune, tuned_sheet
from tomoskin.sensing.fit import LIVE, Pace
from tomoskin.sensing.signal import Reference
from tomoskin.sensing.track import FingerTracker, Tracker


@dataclass(frozen=True, slots=True, eq=False)
class Setting:
    """How frames are followed, whatever the skin.

    Attributes
    ----------
    pace
        Of the fit.
    scan
        What samples are, where frames bring them; None where they bring voltages only.
    rounding
        V, or (n_meas,) V, below which no measurement's noise is; None: what the skin's read-out
        rounds.
    interval
        Between frames, s, where a single one makes the reference.
    alone
        Whether each frame is taken as if it were the only one.
    """

    pace: Pace = LIVE
    scan: Scan | None = None
    rounding: FloatArray | float | None = None
    interval: float = math.nan
    alone: bool = False


class Following:
    """Follows a skin from its rest on.

    Parameters
    ----------
    prepared
        The skin.
    rest
        What it reads untouched.
    conditioning
        What makes difference data of its frames.
    tracker
        Gives the touches their identity.
    setting
        Of the run.
    reference
        Of the first frames: as it was taken, or as the baseline tells it by now.
    """

    def __init__(
        self,
        prepared: Prepared,
        rest: Rest | None,
        conditioning: Conditioning,
        tracker: Tracker,
        setting: Setting,
        *,
        reference: Reference | None,
    ) -> None:
        excluded = None if rest is None else rest.without_reference
        if reference is not None and any(c.kind.fits for c in prepared.calibrations.values()):
            prepared = tuned_sheet(prepared, reference, excluded)  # they are applied once
        self.rest, self._setting = rest, setting
        self._prepared, self._conditioning = prepared, conditioning
        self._tracker = FingerTracker(tracker, prepared.skin.touch.slide_lag)
        self._imaging = _imaging(conditioning, rest, reference)
        interval = np.nan if rest is None else rest.interval
        if not interval > 0:
            interval = setting.interval
        known = rest is None or not located_alone(prepared, rest.agreement)
        self._finder: Finder = finding(prepared, reference, setting.pace, interval, fitted=known)
        self._finding: Finding | None = None
        self._is_outdated = False
        fitted = not isinstance(self._finder, InImage)
        conditions = Fitting(prepared, reference, fitted)
        self._applied = {k: c.apply(conditions) for k, c in prepared.calibrations.items()}
        self._tuning: Steps | None = None
        if reference is not None:
            self._tuning = tune(prepared, reference, excluded)

    @classmethod
    def from_rest(
        cls, prepared: Prepared, rest: Rest, tracker: Tracker, setting: Setting
    ) -> Following:
        """Against the voltages of the untouched skin."""
        conditioning = Followed.of(prepared, rest.reference, rest.without_reference, setting.scan)
        return cls(prepared, rest, conditioning, tracker, setting, reference=rest.reference)

    @classmethod
    def of_differences(cls, prepared: Prepared, tracker: Tracker, setting: Setting) -> Following:
        """Of frames that are difference data already."""
        return cls(prepared, None, GivenDifferences(prepared), tracker, setting, reference=None)

    def with_settings(self, prepared: Prepared, tracker: Tracker) -> Following:
        """One for other settings of the same body that goes on where this one is."""
        spots = self._prepared.spots
        if spots is not None and prepared.spots is spots.even:
            prepared = replace(prepared, spots=spots)
        conditioning = self._conditioning
        if self.rest is not None and isinstance(conditioning, Followed):
            conditioning = conditioning.with_settings(prepared, self.rest.reference)
        return Following(
            prepared,
            self.rest,
            conditioning,
            tracker,
            self._setting,
            reference=conditioning.reference,
        )

    @property
    def prepared(self) -> Prepared:
        """The skin, its alpha as it has been tuned."""
        return self._prepared

    @property
    def conditioning(self) -> Conditioning:
        """What is known of the reference and of the electrodes."""
        return self._conditioning

    def push(self, measured: Measured) -> FrameResult:
        """Take one frame."""
        self._tune()
        self._refind()
        reach("voltages")
        conditioned = self._conditioning.condition(measured)
        if conditioned.differences is None:
            return self._without_touches(measured, conditioned)
        try:
            image, view, detections = self._found(measured.time, conditioned.differences)
        except ModelError as error:  # the next frame may be well
            problem = f"no touch can be found in this frame: {error}"
            failed = replace(conditioned, differences=None, problem=problem)
            return self._without_touches(measured, failed)
        reach("tracking")
        touches = self._tracker.update(detections, measured.time, measured.host_time)
        reach("calibrations")
        readings = self._read(view, detections, touched=bool(touches))
        untouched = not (detections or self._finder.like_touch)
        held = bool(touches) or self._finder.rises
        reach("baseline")
        self._learn(measured.time, touched=held, noise=untouched)
        return self._result(measured, conditioned, image, touches, readings)

    def _found(
        self, time: float, differences: Differences
    ) -> tuple[Image, FrameView, list[Detection]]:
        reach("image")
        image, noise = self._imaging.push(differences.dv, time)
        view = FrameView(time, image, noise, differences)
        reach("touches")
        detections = self._finder.push(view)
        if self._applied:
            reach("calibrations")
            view = replace(view, others=self._finder.others)
        for applied in self._applied.values():
            detections = applied.locate(view, detections)
        return image, view, detections

    def _without_touches(self, measured: Measured, conditioned: Conditioned) -> FrameResult:
        """Of a frame without an image."""
        touches = self._tracker.update([], measured.time, measured.host_time)
        return self._result(measured, conditioned, self._prepared.no_image, touches, {})

    def first(self, measured: Measured) -> FrameResult:
        """The frame that completed the rest: nothing shows in it."""
        return FrameResult.at_rest(
            measured,
            self._prepared.no_image,
            self._conditioning.mean,
            self._tracker.events,
            self._conditioning.state,
        )

    def _read(
        self, view: FrameView, detections: list[Detection], *, touched: bool
    ) -> dict[str, Any]:
        readings = {
            kind: applied.read(view, detections, touched=touched)
            for kind, applied in self._applied.items()
        }
        return {kind: reading for kind, reading in readings.items() if reading is not None}

    def _learn(self, time: float, *, touched: bool, noise: bool) -> None:
        conditioning = self._conditioning
        moved = sum((applied.moved for applied in self._applied.values()), start=0.0)
        learnt = conditioning.learn(time, moved, touched=touched, noise=noise)
        if not any(learnt) or (reference := conditioning.reference) is None:
            return
        if learnt.image:
            prepared = conditioning.prepared
            self._imaging.renew(prepared, reference, conditioning.subspace())
        self._is_outdated = True

    def _refind(self) -> None:
        """One step towards a finder of what is known now; what there is serves meanwhile."""
        if self._finding is None:
            if not self._is_outdated:
                return
            conditioning, self._is_outdated = self._conditioning, False
            self._finding = self._finder.renewing(conditioning.prepared, conditioning.reference)
        reach("new noise")
        try:
            next(self._finding)
        except StopIteration as end:
            self._finder, self._finding = end.value, None

    def _tune(self) -> None:
        """One step towards what the reference says; what there is serves meanwhile."""
        if self._tuning is None or self._finding is not None:
            return
        reach("tuning")
        try:
            better = next(self._tuning)
        except StopIteration:
            self._tuning = None
            return
        if better is not None:
            self._prepared, self._is_outdated = better, True
            self._conditioning.renew(better)
            self._imaging = _imaging(self._conditioning, self.rest, self._conditioning.reference)

    def _result(
        self,
        measured: Measured,
        conditioned: Conditioned,
        image: Image,
        touches: tuple[Touch, ...],
        readings: dict[str, Any],
    ) -> FrameResult:
        shows = conditioned.differences is not None
        return FrameResult(
            sequence=measured.sequence,
            host_time=measured.host_time,
            ready=True,
            has_image=shows,
            image=image,
            voltages=measured.values,
            reference=self._conditioning.mean,
            touches=touches,
            left_out=conditioned.n_excluded,
            events=self._tracker.events,
            health=conditioned.health,
            baseline=self._conditioning.state,
            readings=readings,
            unexplained=conditioned.problem or (shows and self._finder.problem) or None,
        )


def _imaging(
    conditioning: Conditioning, rest: Rest | None, reference: Reference | None
) -> SingleFrame | Filtered:
    interval = np.nan if rest is None else rest.interval
    return imaging(conditioning.prepared, reference, interval, conditioning.subspace())
