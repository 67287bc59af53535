"""From one frame to touches: voltages, reference, difference, picture, touches."""

from __future__ import annotations

from collections.abc import Generator

import numpy as np
from numpy.typing import NDArray

from tomoskin.calibration import BendReading, StateReading
from tomoskin.core import Detection, FloatArray, Frame, Image, Touch, Voltages
from tomoskin.inverse import AlphaChoice
from tomoskin.pipeline.bending import Bends, bends_of
from tomoskin.pipeline.collector import Collector
from tomoskin.pipeline.finding import Finder, View, finding
from tomoskin.pipeline.imaging import Alone, Filtered, imaging
from tomoskin.pipeline.prepare import Prepared
from tomoskin.pipeline.result import ReferenceState, Result
from tomoskin.pipeline.tune import tune
from tomoskin.pipeline.watch import Watch
from tomoskin.signal import Health, Reference
from tomoskin.touch import LIVE, Tracker, TrackSettings

REFERENCE_FRAMES = 20
"""Frames of the untouched skin that make a reference."""


class Pipeline:
    """The frame flow of one skin: no I/O, no clock, memory of fixed size.

    Parameters
    ----------
    prepared
        What was made once for the skin.
    reference_frames
        Frames that make a reference; the first ones do, and again after
        :meth:`take_reference`.
    """

    def __init__(self, prepared: Prepared, *, reference_frames: int = REFERENCE_FRAMES) -> None:
        self._given = self._prepared = prepared
        self._needed = reference_frames
        self._tracker = _tracker(prepared)
        self._image = _none(prepared)
        self._reference: Reference | None = None
        self._watch: Watch | None = None
        self._imaging: Alone | Filtered = Alone(prepared, None)
        self._finder: Finder = finding(prepared, None, LIVE)
        self._bends: Bends | None = None
        self._times: list[float] = []
        self._tuning: Generator[None, None, Prepared] | None = None
        self._since = 0.0
        self.tick_rate = prepared.skin.readout.tick_rate
        """Of the frames' ticks, Hz: the skin's, until the board has said its own."""
        self.paused = False
        self.refused = 0
        """Frames that were not of this skin's scan."""
        self.take_reference()

    def take_reference(self) -> None:
        """Forget the reference; the next frames make a new one."""
        self._reference = self._watch = None
        self._tuning = None
        self._prepared = self._given  # the same frames make the same operator, whatever came before
        self._tracker.reset()
        self._times = []
        prepared = self._prepared
        self._collector = Collector(
            self._needed, prepared.operator.reference, prepared.readout.rounding
        )

    def adopt(self, prepared: Prepared) -> None:
        """Go on with other settings of the same mesh and scan; the reference stands, and what
        has been learnt of it and of the electrodes.
        """
        earlier, before = self._prepared, self._watch
        self._given = self._prepared = prepared
        if prepared.skin.touch.snr != earlier.skin.touch.snr:
            numbered = self._tracker.numbered
            self._tracker = _tracker(prepared)
            self._tracker.numbered = numbered
        self._image, self._tuning = _none(prepared), None
        if self._reference is None or before is None:
            return
        self._watch = before.renewed(prepared, self._reference, self._collector.unusable)
        known = self._watch.baseline.reference
        self._see(known)
        self._tuning = tune(prepared, known)

    @property
    def reference(self) -> Reference | None:
        """What the untouched skin reads as far as it is known now; None until it stands."""
        return None if self._watch is None else self._watch.baseline.reference

    @property
    def reference_state(self) -> ReferenceState:
        """How far the reference is."""
        if self._reference is None:
            return ReferenceState(self._collector.taken, self._needed)
        noise = float(np.sqrt(np.mean(self._reference.noise**2)))
        baseline = self._watch.baseline.state if self._watch else None
        return ReferenceState(self._needed, self._needed, self._since, noise, baseline)

    @property
    def numbered(self) -> int:
        """The last identity that was given to a touch."""
        return self._tracker.numbered

    def number_after(self, last: int) -> None:
        """Give identities after ``last`` from here on."""
        self._tracker.numbered = last

    @property
    def choice(self) -> AlphaChoice:
        """The alpha of the pictures, and what chose it."""
        return self._prepared.choice

    def push(self, frame: Frame) -> Result | None:
        """Take one frame; None while paused, or where the frame is not of this scan."""
        if self.paused:
            return None
        if len(frame.samples) != self._prepared.scan.n_samples:
            self.refused += 1
            return None
        voltages = self._prepared.readout(frame)
        unusable = voltages.railed | ~np.isfinite(voltages.values)
        if self._watch is None or self._reference is None:
            return self._collect(voltages, unusable)
        self._tune(self._reference)
        return self._picture(voltages, unusable, frame.samples, self._watch)

    def _collect(self, voltages: Voltages, unusable: NDArray[np.bool_]) -> Result:
        self._collector.add(voltages.values, unusable)
        self._times.append(self._time(voltages))
        if self._collector.done:
            self._settle(self._collector.reference(), voltages.host_time)
        left_out = int(np.count_nonzero(unusable))
        return self._result(voltages, self._image, (), left_out, pictured=True)

    def _settle(self, reference: Reference, host_time: float) -> None:
        self._watch = Watch(
            self._prepared, reference, self._collector.unusable, self._prepared.scan
        )
        self._see(reference)
        self._tuning = tune(self._prepared, reference)
        self._reference = reference
        self._since = host_time

    def _see(self, reference: Reference) -> None:
        """Images and touches from here on."""
        watch = self._watch
        prepared, blind = (watch.prepared, watch.steady()) if watch else (self._prepared, None)
        self._imaging = imaging(prepared, reference, self._interval(), blind)
        self._finder = finding(prepared, reference, LIVE)
        self._bends = bends_of(prepared, reference, self._finder)

    def _tune(self, reference: Reference) -> None:
        """One step towards the operator for the reference's noise; the old one serves meanwhile."""
        if self._tuning is None:
            return
        try:
            next(self._tuning)
        except StopIteration as end:
            self._tuning = None
            if end.value is not self._prepared:
                self._prepared = end.value
                self._retake(reference)

    def _retake(self, reference: Reference) -> None:
        blind, prepared = None, self._prepared
        if self._watch is not None:
            self._watch.take(self._prepared)
            reference, blind = self._watch.baseline.reference, self._watch.steady()
            prepared = self._watch.prepared
        self._imaging = imaging(prepared, reference, self._interval(), blind)
        self._finder.renew(prepared, reference)

    def _picture(
        self,
        voltages: Voltages,
        unusable: NDArray[np.bool_],
        samples: NDArray[np.uint16],
        watch: Watch,
    ) -> Result:
        now = self._time(voltages)
        seen = watch.look(voltages.values, unusable, now, samples)
        if seen.dv is None:
            touches = self._track([], voltages)
            return self._result(
                voltages, self._image, touches, seen.left_out, health=seen.health, pictured=False
            )
        image, floor = self._imaging.push(seen.dv, now)
        view = View(image, floor, seen.dv, seen.blind.directions, seen.whole)
        detections = self._finder.push(view)
        touches = self._track(detections, voltages)
        touched, bend = bool(touches), None
        if self._bends:
            bend = self._bends.push(watch, seen, view, detections, now, touched=touched)
        if watch.learn(now, touched=touched):
            self._imaging.renew(watch.prepared, watch.baseline.reference, watch.steady())
            self._finder.renew(watch.prepared, watch.baseline.reference)
        return self._result(
            voltages,
            image,
            touches,
            seen.left_out,
            health=seen.health,
            bend=bend,
            state=self._told(voltages, unusable | seen.health.lost),
            pictured=True,
        )

    def _told(self, voltages: Voltages, lost: NDArray[np.bool_]) -> StateReading | None:
        """What state the frame shows, against the reference as it was taken: a state that lasts
        is not to be learnt as the skin's rest."""
        teller, reference = self._prepared.teller, self._reference
        if teller is None or reference is None:
            return None
        return teller(np.where(lost, np.nan, voltages.values - reference.mean))

    def _track(self, detections: list[Detection], voltages: Voltages) -> tuple[Touch, ...]:
        return self._tracker.update(detections, self._time(voltages), voltages.host_time)

    def _result(
        self,
        voltages: Voltages,
        image: Image,
        touches: tuple[Touch, ...],
        left_out: int,
        *,
        pictured: bool,
        health: Health | None = None,
        bend: BendReading | None = None,
        state: StateReading | None = None,
    ) -> Result:
        return Result(
            sequence=voltages.sequence,
            host_time=voltages.host_time,
            ready=self._reference is not None,
            pictured=pictured,
            image=image,
            voltages=voltages.values,
            reference=self._expected(),
            touches=touches,
            events=self._tracker.events,
            left_out=left_out,
            health=health,
            baseline=self._watch.baseline.state if self._watch else None,
            bend=bend,
            state=state,
        )

    def _time(self, voltages: Voltages) -> float:
        """The device's own seconds: host times of frames that were read together are the same."""
        return voltages.ticks / self.tick_rate

    def _interval(self) -> float:
        """Between frames while the reference was taken, s; NaN where a single one was."""
        return float(np.median(np.diff(self._times))) if len(self._times) > 1 else np.nan

    def _expected(self) -> FloatArray:
        return self._watch.baseline.mean if self._watch else self._prepared.operator.reference


def _tracker(prepared: Prepared) -> Tracker:
    return Tracker(TrackSettings(snr=prepared.skin.touch.snr))


def _none(prepared: Prepared) -> Image:
    return prepared.operator(np.zeros(prepared.pattern.n_meas))
