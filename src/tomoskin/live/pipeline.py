"""From one frame to touches: voltages, reference, difference, picture, touches."""

from __future__ import annotations

from collections.abc import Generator

import numpy as np
from numpy.typing import NDArray

from tomoskin.core import FloatArray, Frame, Image, Reading, Touch, Voltages
from tomoskin.inverse import MOST_LEFT_OUT, AlphaChoice
from tomoskin.live.collector import Collector
from tomoskin.live.imaging import Alone, Filtered, imaging
from tomoskin.live.prepare import Prepared
from tomoskin.live.result import ReferenceState, Result
from tomoskin.live.tune import tune
from tomoskin.signal import Reference, difference
from tomoskin.touch import Tracker, TrackSettings

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
        self._prepared = prepared
        self._needed = reference_frames
        self._tracker = Tracker(TrackSettings(snr=prepared.skin.touch.snr))
        self._image = _none(prepared)
        self._reference: Reference | None = None
        self._imaging: Alone | Filtered = Alone(prepared, None)
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
        self._reference = None
        self._tuning = None
        self._tracker.reset()
        self._times = []
        self._collector = Collector(self._needed, self._prepared.operator.reference)

    @property
    def reference_state(self) -> ReferenceState:
        """How far the reference is."""
        if self._reference is None:
            return ReferenceState(self._collector.taken, self._needed)
        noise = float(np.sqrt(np.mean(self._reference.noise**2)))
        return ReferenceState(self._needed, self._needed, self._since, noise)

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
        if self._reference is None:
            return self._collect(voltages, unusable)
        self._tune(self._reference)
        return self._picture(voltages, unusable | self._collector.unusable, self._reference)

    def _collect(self, voltages: Voltages, unusable: NDArray[np.bool_]) -> Result:
        self._collector.add(voltages.values, unusable)
        self._times.append(self._time(voltages))
        if self._collector.done:
            self._settle(self._collector.reference(), voltages.host_time)
        return self._result(voltages, self._image, (), unusable, pictured=True)

    def _settle(self, reference: Reference, host_time: float) -> None:
        self._imaging = imaging(self._prepared, reference, self._interval())
        self._tuning = tune(self._prepared, reference)
        self._reference = reference
        self._since = host_time

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
                self._imaging = imaging(self._prepared, reference, self._interval())

    def _picture(
        self, voltages: Voltages, unusable: NDArray[np.bool_], reference: Reference
    ) -> Result:
        p = self._prepared
        if np.count_nonzero(unusable) > MOST_LEFT_OUT * len(unusable):
            touches = self._track([], voltages)
            return self._result(voltages, self._image, touches, unusable, pictured=False)
        values = np.where(unusable, reference.mean, voltages.values)
        dv = difference(values, reference.mean, p.skin.inverse.difference)
        filled = p.operator.filled(dv, unusable)
        image, floor = self._imaging.push(filled, self._time(voltages))
        readings = p.segmenter(image, floor)
        touches = self._track(readings, voltages)
        return self._result(voltages, image, touches, unusable, pictured=True)

    def _track(self, readings: list[Reading], voltages: Voltages) -> tuple[Touch, ...]:
        return self._tracker.update(readings, self._time(voltages), voltages.host_time)

    def _result(
        self,
        voltages: Voltages,
        image: Image,
        touches: tuple[Touch, ...],
        unusable: NDArray[np.bool_],
        *,
        pictured: bool,
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
            left_out=int(np.count_nonzero(unusable)),
        )

    def _time(self, voltages: Voltages) -> float:
        """The device's own seconds: host times of frames that were read together are the same."""
        return voltages.ticks / self.tick_rate

    def _interval(self) -> float:
        """Between frames while the reference was taken, s; NaN where a single one was."""
        return float(np.median(np.diff(self._times))) if len(self._times) > 1 else np.nan

    def _expected(self) -> FloatArray:
        return self._reference.mean if self._reference else self._prepared.operator.reference


def _none(prepared: Prepared) -> Image:
    return prepared.operator(np.zeros(prepared.pattern.n_meas))
