"""The second state of the pipeline: each frame to its image, touches and what else was learnt."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np

from tomoskin.core import (
    Detection,
    FloatArray,
    Image,
    ModelError,
    Touch,
    Voltages,
    finished,
    reach,
    show,
)
from tomoskin.learning import Differences, FrameView, Reading
from tomoskin.model.pattern import Scan
from tomoskin.pipeline import finding
from tomoskin.pipeline.aside import Aside, frames_aside
from tomoskin.pipeline.conditioning import (
    MOST_NUISANCE,
    BaselineDifferences,
    Conditioned,
    Conditioning,
    GivenDifferences,
)
from tomoskin.pipeline.diagnosis import Cause, Diagnosis
from tomoskin.pipeline.drives import DriveResult, DriveWatch
from tomoskin.pipeline.frame_result import FrameResult
from tomoskin.pipeline.imaging import Filtered, SingleFrame
from tomoskin.pipeline.prepare import Prepared
from tomoskin.pipeline.rest import BodySheets, Rest, Steps, tune, tuned_sheet
from tomoskin.sensing.fit import LIVE, Pace
from tomoskin.sensing.signal import Reference
from tomoskin.sensing.track import Rim, SlideCorrection, Tracker

_STEP = 5e-3
"""Seconds between two frames that allow one step of what is prepared anew. A step is a millisecond
of work or two; counted by the device's clock, a replay takes the same steps."""


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

    Attributes
    ----------
    prepared
        The skin, its alpha as it has been tuned.
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
        self.prepared, self.conditioning = prepared, conditioning
        self._tracker = tracker
        self._imaging = _imaging(conditioning, rest, reference)
        interval = np.nan if rest is None else rest.interval
        if not interval > 0:
            interval = setting.interval
        self._steps = max(1, int(interval / _STEP)) if interval > 0 else 1
        alone = setting.alone or reference is None
        self._patience = 0 if alone else frames_aside(prepared.pattern.n_meas, interval)
        self._aside: Aside[Callable[[], None]] | None = None
        known = rest is None or not finding.located_alone(prepared, rest.agreement)
        self._finder = finding.finder_of(prepared, reference, setting.pace, interval, fitted=known)
        if (expected := conditioning.expected()) is not None:
            self._finder.foresee(*expected)
        self._renewal: finding.FinderSteps | None = None
        self._is_outdated = False
        fitted = isinstance(self._finder, finding.FitFinder)
        conditions = finding.FitConditions(prepared, reference, fitted, interval, setting.alone)
        self._applied = {k: c.apply(conditions) for k, c in prepared.calibrations.items()}
        self._calibrated = frozenset(self._applied)
        if (lag := prepared.skin.touch.slide_lag) is None:
            lag = sum(applied.slide_lag for applied in self._applied.values())
        tracker.slides, tracker.rim = SlideCorrection(lag), Rim.of(prepared.skin.outline)
        self._tuning = None if reference is None else tune(prepared, reference, excluded)
        self._sheets: BodySheets | None = None
        poses = [applied.poses for applied in self._applied.values() if len(applied.poses)]
        plain = prepared.operator.difference == "plain"
        self._taught = bool(poses)
        if poses and reference and prepared.spots and fitted and plain:
            self._sheets = BodySheets(prepared.spots, reference, poses[0])
        self._interval = interval if interval > 0 else prepared.longest_scan
        self._drives: DriveWatch | None = None

    @classmethod
    def from_rest(
        cls, prepared: Prepared, rest: Rest, tracker: Tracker, setting: Setting
    ) -> Following:
        """Against the voltages of the untouched skin."""
        conditioning = BaselineDifferences.of(
            prepared, rest.reference, rest.without_reference, setting.scan
        )
        return cls(prepared, rest, conditioning, tracker, setting, reference=rest.reference)

    @classmethod
    def of_differences(cls, prepared: Prepared, tracker: Tracker, setting: Setting) -> Following:
        """Of frames that are difference data already."""
        return cls(prepared, None, GivenDifferences(prepared), tracker, setting, reference=None)

    def with_settings(self, prepared: Prepared, tracker: Tracker) -> Following:
        """One for other settings of the same body that goes on where this one is."""
        spots = self.prepared.spots if self._sheets is None else self._sheets.rest
        if spots is not None and prepared.spots is spots.even:
            prepared = replace(prepared, spots=spots)
        conditioning = self.conditioning
        if self.rest is not None and isinstance(conditioning, BaselineDifferences):
            conditioning = conditioning.with_settings(prepared, self.rest.reference)
        return Following(
            prepared,
            self.rest,
            conditioning,
            tracker,
            self._setting,
            reference=conditioning.reference,
        )

    def push(self, measured: Voltages) -> FrameResult:
        """Take the voltages of one frame all the way to touches."""
        self._prepare_anew()
        reach("voltages")
        show("voltages", measured)
        conditioned = self.conditioning.condition(measured)
        show("conditioned", conditioned)
        if conditioned.differences is None:
            return self._without_touches(measured, conditioned)
        try:
            view, detections = self._detected(measured.time, conditioned.differences)
        except ModelError as error:  # the next frame may be well
            text = f"no touch can be found in this frame: {error}"
            problem = Diagnosis(Cause.NO_IMAGE, text)
            failed = replace(conditioned, differences=None, problem=problem)
            return self._without_touches(measured, failed)
        reach("tracking")
        show("detections", detections)
        touches = self._tracker.update(detections, measured.time, measured.host_time)
        touches = tuple(map(self._everywhere, touches))
        show("touches", touches)
        show("events", self._tracker.events)
        if self._drives is not None:  # no number is given twice
            ledger, responses = self._tracker.ledger, self._tracker.responses
            ledger.numbered = self._drives.confirm(responses, measured.time, ledger.numbered)
        if self._finder.learn(touched=bool(self._tracker.traces)):
            self._tracker.residuals.forget()
        readings = {}
        if self._applied:
            reach("calibrations")
            for kind, applied in self._applied.items():
                reading = applied.read(view, detections, touched=bool(touches))
                if reading is not None:
                    readings[kind] = reading
            show("readings", readings)
        reach("baseline")
        self._learn(
            measured.time,
            touched=bool(touches) or self._finder.rises,
            noise=not (detections or self._finder.like_touch),
            deformed=self._finder.moved,
        )
        return self._result(measured, conditioned, view.image, touches, readings)

    def push_drive(
        self, drive: int, values: FloatArray, clock: tuple[float, float], *, late: bool
    ) -> DriveResult | None:
        """Take ``values`` (n_meas,) V of which those of a drive are new; what is known then, or
        None where drives tell nothing. ``clock`` and ``late``: see :meth:`DriveWatch.push`."""
        if not isinstance(self._finder, finding.FitFinder):
            return None
        dv = self.conditioning.newest(values)
        if dv is None:
            return None
        view = self._finder.spots.view
        if self._drives is None or self._drives.view is not view:
            follows = not any(c.kind.locates for c in self.prepared.calibrations.values())
            pattern = self.prepared.pattern
            self._drives = DriveWatch(view, pattern, self._interval, follows=follows)
        if self._finder.problem and not self._drives.follows_some:
            return None  # what is neither touch nor noise would look like a touch
        result = self._drives.push(drive, dv, clock, self._tracker.ledger.numbered, late=late)
        if result is None:
            return None
        finger = self._tracker.finger
        touches = (self._everywhere(finger(touch)) for touch in result.touches)
        return replace(result, touches=tuple(touches))

    def early(self, result: FrameResult) -> FrameResult:
        """The newest ``result`` for those who were told of drives before."""
        if self._drives is None:
            return result
        touches = tuple(map(self._everywhere, self._drives.among(result.touches)))
        return replace(result, touches=touches)

    def _everywhere(self, touch: Touch) -> Touch:
        """With the other places that the pattern cannot tell from its own; presses that taught
        positions have told which it is."""
        ambiguity = self.prepared.ambiguity
        if ambiguity is None or any(c.kind.locates for c in self.prepared.calibrations.values()):
            return touch
        return replace(touch, elsewhere=ambiguity.elsewhere(touch.detection.x, touch.detection.y))

    def _detected(self, time: float, differences: Differences) -> tuple[FrameView, list[Detection]]:
        """What a frame shows, and the touches in it."""
        reach("image")
        image, noise = self._imaging.push(differences.dv, time)
        show("image", image)
        view = FrameView(time, image, noise, differences)
        reach("touches")
        detections = self._finder.push(view)
        if self._applied:
            reach("calibrations")
            view = replace(view, others=self._finder.others)
            for applied in self._applied.values():
                detections = applied.locate(view, detections)
        return view, detections

    def _without_touches(self, measured: Voltages, conditioned: Conditioned) -> FrameResult:
        """Of a frame without an image."""
        touches = self._tracker.update([], measured.time, measured.host_time)
        return self._result(measured, conditioned, self.prepared.no_image, touches, {})

    def first(self, measured: Voltages) -> FrameResult:
        """The frame that completed the rest: nothing shows in it."""
        mean, state = self.conditioning.mean, self.conditioning.state
        result = FrameResult.at_rest(measured, self.prepared.no_image, mean, state)
        shows = result.left_out <= MOST_NUISANCE * len(measured.values)
        return replace(result, has_image=shows, calibrated=self._calibrated)

    def _learn(
        self, time: float, *, touched: bool, noise: bool, deformed: FloatArray | None
    ) -> None:
        """``deformed`` (n_meas,) of difference data is what a deformation has moved: that is not
        learnt."""
        conditioning = self.conditioning
        moved = sum((applied.moved for applied in self._applied.values()), 0.0)
        if self._sheets is not None and self._tuning is None and isinstance(moved, np.ndarray):
            self._tuning = self._sheets.steps(self.prepared, moved)
        if deformed is not None:
            moved = moved + conditioning.volts(deformed)
        learnt = conditioning.learn(time, moved, touched=touched, noise=noise)
        if learnt.image and (reference := conditioning.reference) is not None:
            self._imaging.renew(conditioning.prepared, reference, conditioning.subspace())
        self._is_outdated |= learnt.image or learnt.touches

    def _prepare_anew(self) -> None:
        """As many steps as the time between two frames allows, while there is something to do; all
        of them in a thread where one would take too long."""
        if self._patience:
            self._prepare_aside()
            return
        for _ in range(self._steps):
            if self._tuning is None and self._renewal is None and not self._is_outdated:
                return
            if self._tuning is not None and self._renewal is None:
                reach("tuning")
                self._take_tuned(_first(self._tuning))
            self._refind()

    def _prepare_aside(self) -> None:
        """Begin what is to be done, or take what has been done, at the frame that is to have it."""
        if self._aside is None:
            if self._tuning is not None:
                self._aside = Aside(partial(_tuned, self._tuning, self._take_tuned), self._patience)
            elif self._is_outdated:
                work = partial(_renewed, self._renewing(), self._take_finder)
                self._aside = Aside(work, self._patience)
        elif self._aside.is_due():
            done, self._aside = self._aside, None
            reach("new noise")
            done.result()()

    def _refind(self) -> None:
        """One step towards a finder of what is known now; what there is serves meanwhile."""
        if self._renewal is None:
            if not self._is_outdated:
                return
            self._renewal = self._renewing()
        reach("new noise")
        try:
            next(self._renewal)
        except StopIteration as end:
            self._renewal = None
            self._take_finder(end.value)

    def _renewing(self) -> finding.FinderSteps:
        conditioning, self._is_outdated = self.conditioning, False
        reference = conditioning.reference
        if reference is not None and self._sheets is not None:
            reference = self._sheets.shifted(reference)
        return self._finder.renewing(conditioning.prepared, reference)

    def _take_finder(self, adopt: Callable[[], finding.Finder]) -> None:
        self._finder = adopt()
        if isinstance(self._finder, finding.FitFinder):
            for applied in self._applied.values():
                applied.renew(self._finder.model.response, self._finder.volts)

    def _take_tuned(self, step: tuple[Prepared | None, bool]) -> None:
        """Go on with what the reference has told so far; what there was served meanwhile."""
        better, ended = step
        if ended:
            self._tuning = None
        if better is not None:
            images = better.operator is not self.prepared.operator
            self.prepared, self._is_outdated = better, True
            self.conditioning.renew(better)
            if images:
                self._imaging = _imaging(self.conditioning, self.rest, self.conditioning.reference)

    def _result(
        self,
        measured: Voltages,
        conditioned: Conditioned,
        image: Image,
        touches: tuple[Touch, ...],
        readings: dict[str, Any],
    ) -> FrameResult:
        shows = conditioned.differences is not None
        deformed = None if self._taught or not shows else self._finder.deformation
        own = self._finder.problem if shows else None
        doubts = self._doubts(readings), conditioned.problem, own
        return FrameResult(
            sequence=measured.sequence,
            host_time=measured.host_time,
            ready=True,
            has_image=shows,
            image=image,
            voltages=measured.values,
            reference=self.conditioning.mean,
            touches=touches,
            left_out=conditioned.n_excluded,
            events=self._tracker.events,
            health=conditioned.health,
            baseline=self.conditioning.state,
            readings=readings,
            calibrated=self._calibrated,
            diagnoses=tuple(filter(None, doubts)),
            deformation=deformed,
            scanned=measured.scanned,
            scan_time=measured.scan_time,
        )

    @staticmethod
    def _doubts(readings: dict[str, Any]) -> Diagnosis | None:
        """What is wrong with what calibrations have read."""
        said = (one.problem for one in readings.values() if isinstance(one, Reading))
        text = next(filter(None, said), None)
        return None if text is None else Diagnosis(Cause.TAUGHT, text)


def _imaging(
    conditioning: Conditioning, rest: Rest | None, reference: Reference | None
) -> SingleFrame | Filtered:
    """What makes the images: filtered where the skin has a time constant."""
    prepared, subspace = conditioning.prepared, conditioning.subspace()
    if prepared.modes is None:
        return SingleFrame(prepared, reference, subspace)
    interval = np.nan if rest is None else rest.interval
    return Filtered(prepared, prepared.modes, reference, interval, subspace)


def _first(tuning: Steps) -> tuple[Prepared | None, bool]:
    """One step of a tuning: the skin where it is prepared better from now on; whether it ended."""
    try:
        return next(tuning), False
    except StopIteration:
        return None, True


def _tuned(
    tuning: Steps, take: Callable[[tuple[Prepared | None, bool]], None]
) -> Callable[[], None]:
    """Steps up to the next that prepares the skin better; then how it is to be taken."""
    step = _first(tuning)
    while step == (None, False):
        step = _first(tuning)
    return partial(take, step)


def _renewed(
    renewal: finding.FinderSteps, take: Callable[[Callable[[], finding.Finder]], None]
) -> Callable[[], None]:
    """All steps towards a finder; then how it is to be taken."""
    return partial(take, finished(renewal))
