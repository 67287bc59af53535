"""The frame flow: a reference is collected, then every frame is followed to its touches."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from tomoskin.board.source import ScanTimer
from tomoskin.core import DriveSamples, Frame, Mark, Voltages, reach, show
from tomoskin.imaging import AlphaChoice
from tomoskin.pipeline.drives import DriveResult
from tomoskin.pipeline.following import Following, Setting
from tomoskin.pipeline.frame_result import FrameResult, ReferenceState
from tomoskin.pipeline.prepare import Prepared
from tomoskin.pipeline.rest import Collecting
from tomoskin.sensing.signal import Reference
from tomoskin.sensing.track import Tracker, TrackSettings

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
        :meth:`take_reference`. 0: frames are difference data, which need none.
    setting
        How frames are followed where they are no frames of a board; see :class:`Setting`.

    Attributes
    ----------
    refused
        Frames that were not of this skin's scan.
    tick_rate
        Of the frames' ticks, Hz: the skin's, until the board has said its own.
    """

    def __init__(
        self,
        prepared: Prepared,
        *,
        reference_frames: int = REFERENCE_FRAMES,
        setting: Setting | None = None,
    ) -> None:
        self._given, self._needed = prepared, reference_frames
        self._setting = setting or Setting(scan=prepared.scan)
        self._tracker = self._new_tracker()
        self.tick_rate = prepared.readout.tick_rate
        self.refused = 0
        self._clock = ScanTimer()
        self._samples = np.zeros(prepared.scan.n_samples, np.uint16)
        self._sums = self._samples.copy()
        self.take_reference()

    def take_reference(self) -> None:
        """Forget the reference; the next frames make a new one."""
        # the same frames make the same operator, whatever came before
        given, rounding = self._given, self._setting.rounding
        self._tracker.reset()
        self._state: Collecting | Following
        if not self._needed:
            self._state = Following.of_differences(given, self._tracker, self._setting)
            return
        self._state = Collecting(
            self._needed,
            given.operator.reference,
            given.readout.rounding if rounding is None else rounding,
        )

    def collect(self, frames: int) -> None:
        """Make references of so many ``frames``; one of another number begins anew."""
        if frames != self._needed:
            self._needed = frames
            self.take_reference()

    def adopt(self, prepared: Prepared) -> None:
        """Go on with other settings of the same body; the reference stands, and what has been
        learnt of it and of the electrodes.
        """
        before, self._given = self._given, prepared
        if prepared.skin.touch.snr != before.skin.touch.snr:
            numbered = self.numbered
            self._tracker = self._new_tracker()
            self.number_after(numbered)
        if isinstance(self._state, Following):
            self._state = self._state.with_settings(prepared, self._tracker)

    @property
    def reference(self) -> Reference | None:
        """What the untouched skin reads as far as it is known now; None until it stands."""
        state = self._state
        return state.conditioning.reference if isinstance(state, Following) else None

    @property
    def reference_state(self) -> ReferenceState:
        """How far the reference is, and how its baseline does."""
        state, needed = self._state, self._needed
        if isinstance(state, Collecting):
            return ReferenceState(state.taken, needed)
        if state.rest is None:
            return ReferenceState(0, 0)
        noise = float(np.sqrt(np.mean(state.rest.reference.noise**2)))
        baseline = state.conditioning.state
        return ReferenceState(
            needed, needed, state.rest.host_time, noise, baseline, state.rest.agreement
        )

    @property
    def numbered(self) -> int:
        """The last identity that was given to a touch."""
        return self._tracker.ledger.numbered

    def number_after(self, last: int) -> None:
        """Give identities after ``last`` from here on."""
        self._tracker.ledger.numbered = last

    @property
    def choice(self) -> AlphaChoice:
        """The alpha of the images, and what chose it."""
        state = self._state
        return (state.prepared if isinstance(state, Following) else self._given).choice

    def push(self, frame: Frame, mark: Mark = Mark.NONE) -> FrameResult | None:
        """Take one frame as its ``mark`` says; None where it is left out or not of this scan."""
        if mark is not Mark.NONE:
            if mark & Mark.SKIPPED:
                return None
            if mark & Mark.REFERENCE:
                self.take_reference()
            if mark & Mark.HELD:
                return None
        given = self._given
        if len(frame.samples) != given.scan.n_samples:
            self.refused += 1
            return None
        show("frame", frame)
        rate = self.tick_rate or given.readout.tick_rate
        scan = self._clock.middle(frame, given.longest_scan, rate)
        return self.follow(given.readout(frame, rate, scan))

    def push_drive(self, part: DriveSamples, *, late: bool = False) -> DriveResult | None:
        """Take one drive, before the frame that it becomes a part of.

        What is known of touches then, or None where drives tell nothing, and where this one is
        ``late``: a newer one is there already, which is to be asked.
        """
        state, given = self._state, self._given
        drives = given.scan.sample_drive == part.drive
        if not isinstance(state, Following) or len(part.samples) != np.count_nonzero(drives):
            return None
        self._samples[drives] = part.samples
        if part.sums is not None:
            self._sums[drives] = part.sums
        sums = None if part.sums is None else self._sums
        values, railed = given.readout.rows(self._samples, sums)
        if railed[given.pattern.drive_index == part.drive].any():
            return None
        rate = self.tick_rate or given.readout.tick_rate
        clock = part.ticks / rate, part.host_time
        known = state.push_drive(part.drive, values, clock, late=late)
        if known is None:
            return None
        middle, length = self._clock.drive(part, given.pattern.n_drive)
        return replace(known, scanned=middle, scan_time=length)

    def early(self, result: FrameResult) -> FrameResult:
        """The newest ``result`` for those who were told of drives before: it neither shows touches
        again that have been lifted, nor hides those that no frame has had time to confirm."""
        return self._state.early(result) if isinstance(self._state, Following) else result

    def follow(self, measured: Voltages) -> FrameResult:
        """Take one frame whose voltages are known already: what :meth:`push` does with counts."""
        if isinstance(self._state, Following):
            return self._state.push(measured)
        given, rest = self._given, self._state.push(measured)
        if rest is None:
            return FrameResult.at_rest(measured, given.no_image, given.operator.reference)
        reach("reference")
        self._state = Following.from_rest(given, rest, self._tracker, self._setting)
        return self._state.first(measured)

    def _new_tracker(self) -> Tracker:
        return Tracker(TrackSettings(self._given.skin.touch.snr, still=self._setting.alone))
