"""The frame flow over a recording: reference, images and touches without a clock."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from tomoskin.calibration import BendReading, StateReading
from tomoskin.core import DataError, Detection, FloatArray, IntArray, Touch
from tomoskin.inverse import AlphaChoice
from tomoskin.pipeline.bending import bends_of
from tomoskin.pipeline.changes import Changes, Idle, changes_of
from tomoskin.pipeline.finding import View, finding, rows_of
from tomoskin.pipeline.imaging import imaging
from tomoskin.pipeline.prepare import Prepared
from tomoskin.pipeline.tune import tuned, tuned_by_rule
from tomoskin.pipeline.watch import Seen, Watch
from tomoskin.signal import Recording, undone
from tomoskin.touch import STILL, Tracker


@dataclass(frozen=True, eq=False)
class Reconstruction:
    """Images and touches of a recording.

    Attributes
    ----------
    frames
        (n,) indices in the recording of the frames that were reconstructed.
    rows_missing
        (n,) number of rows that each of them lacks beside ``rows_left_out``: they were filled in
        so that they do not count.
    left_out
        (k,) indices of those that lack too many rows.
    images
        (n, n_cells) change of conductivity, in ``unit``.
    touches
        One tuple a frame.
    agreement
        Cosine between the reference and the model's voltages, NaN where there is no reference.
    choice
        The alpha of the images, and what chose it.
    rows_left_out
        (r,) rows of the pattern that hold no finite values, left out of every image.
    bends
        How the sheet was bent in each frame, None where too little was left of it; empty where
        its bends were not learnt.
    states
        One a frame; empty where none were learnt.
    """

    frames: IntArray
    rows_missing: IntArray
    left_out: IntArray
    images: FloatArray
    unit: str
    touches: tuple[tuple[Touch, ...], ...]
    agreement: float
    choice: AlphaChoice
    rows_left_out: IntArray
    bends: tuple[BendReading | None, ...] = ()
    states: tuple[StateReading, ...] = ()

    def numbered_from(self, first: int) -> Reconstruction:
        """Frames counted from ``first``, for a part of a longer recording."""
        return replace(self, frames=self.frames + first, left_out=self.left_out + first)


def reconstruct(
    prepared: Prepared,
    recording: Recording,
    idle: Idle,
    *,
    rule: str | None = None,
    advance: Callable[[float, float], None] = lambda _done, _total: None,
) -> Reconstruction:
    """Reconstruct every frame of ``recording``, whose rows are in the pattern's order.

    Where the skin has a time constant, the images are those of the filter that runs live: each
    rests on its own frame and the ones before.

    Parameters
    ----------
    idle
        What the frames are held against; see :data:`Idle`.
    rule
        Chooses alpha from this recording, by a name of :data:`tomoskin.inverse.RULES`; without
        it the skin's alpha holds, "auto" at the noise of the idle frames.
    advance
        Told how many frames of how many are done.

    Raises
    ------
    DataError
        When the rows are not in the pattern's order, the reference does not look like this
        skin, too few frames or rows are left, the recording lacks what the rule needs, or its
        times do not go on where the skin has a time constant.
    ModelError
        When the rule is not known or finds no alpha.
    """
    changes = changes_of(prepared, recording, idle)
    prepared = _tuned(changes, rule)
    time = recording.time[changes.frames]
    if prepared.modes is not None:
        _check_times(time, idle, recording.source)
    tracker = Tracker(replace(STILL, snr=prepared.skin.touch.snr))
    stage = _Stage(prepared, changes, time)
    images, touches, bends = [], [], []
    for number, now in enumerate(time.tolist()):
        view = stage.push(number, now)
        images.append(view.image)
        detections = stage.finder.push(view)
        touches.append(tracker.update(detections, now, now))
        touched = bool(touches[-1])
        bends.append(stage.bent(view, detections, now, touched=touched))
        stage.learn(now, touched=touched)
        advance(number + 1, len(time))
    return Reconstruction(
        frames=changes.frames,
        rows_missing=changes.missing.sum(axis=1),
        left_out=changes.left_out,
        images=np.stack([image.values for image in images]),
        unit=prepared.operator.unit,
        touches=tuple(touches),
        agreement=changes.agreement,
        choice=prepared.choice,
        rows_left_out=changes.rows_left_out,
        bends=() if prepared.bending is None else tuple(bends),
        states=_told(prepared, changes),
    )


def _tuned(changes: Changes, rule: str | None) -> Prepared:
    if rule is not None:
        return tuned_by_rule(changes.prepared, rule, changes.evidence())
    if changes.reference is None:
        return changes.prepared
    return tuned(changes.prepared, changes.reference)


def _told(prepared: Prepared, changes: Changes) -> tuple[StateReading, ...]:
    """What state each frame shows, against the reference as it is given."""
    if prepared.teller is None:
        return ()
    found = []
    for dv, missing in zip(changes.values, changes.missing, strict=True):
        change = dv
        if changes.reference is not None:
            mean = changes.reference.mean
            change = undone(dv, mean, prepared.operator.difference) - mean
        found.append(prepared.teller(np.where(missing, np.nan, change)))
    return tuple(found)


class _Stage:
    """Frame by frame as the pipeline does it live, where there is a reference to follow."""

    def __init__(self, prepared: Prepared, changes: Changes, time: FloatArray) -> None:
        self._prepared, self._changes = prepared, changes
        interval = float(np.median(np.diff(time))) if len(time) > 1 else np.nan
        self._watch: Watch | None = None
        blind = None
        if changes.reference is not None:
            none = np.zeros(prepared.pattern.n_meas, bool)
            self._watch = Watch(prepared, changes.reference, none, None)
            blind = self._watch.steady()
        self._imaging = imaging(prepared, changes.reference, interval, blind)
        self.finder = finding(prepared, changes.reference)
        self._bends = None
        if changes.reference is not None:
            self._bends = bends_of(prepared, changes.reference, self.finder)
        self._seen: Seen | None = None

    def push(self, number: int, now: float) -> View:
        """What that frame of the changes shows."""
        dv, missing = self._changes.values[number], self._changes.missing[number]
        if self._watch is None or self._changes.reference is None:
            return self._filled(dv, missing, now)
        values = undone(dv, self._changes.reference.mean, self._prepared.operator.difference)
        seen = self._seen = self._watch.look(values, missing, now)
        if seen.dv is None:  # the frames' own limit is narrower, but electrodes add to it
            return self._filled(dv, missing, now)
        blind = seen.blind.directions
        return View(*self._imaging.push(seen.dv, now), seen.dv, blind, seen.whole)

    def bent(
        self, view: View, detections: list[Detection], now: float, *, touched: bool
    ) -> BendReading | None:
        """How the sheet was bent in the frame that was pushed last, where that is known."""
        if self._bends is None or self._watch is None or self._seen is None:
            return None
        return self._bends.push(self._watch, self._seen, view, detections, now, touched=touched)

    def _filled(self, dv: FloatArray, missing: NDArray[np.bool_], now: float) -> View:
        filled = self._prepared.operator.filled(dv, missing)
        return View(*self._imaging.push(filled, now), filled, rows_of(missing))

    def learn(self, now: float, *, touched: bool) -> None:
        """What the frame tells of the reference."""
        watch = self._watch
        if watch is not None and watch.learn(now, touched=touched):
            self._imaging.renew(watch.prepared, watch.baseline.reference, watch.steady())
            self.finder.renew(watch.prepared, watch.baseline.reference)


def _check_times(time: FloatArray, idle: Idle, source: str) -> None:
    """Raises DataError where a filter over the frames makes no sense."""
    if isinstance(idle, str):
        raise DataError(
            "each frame against the one before it cannot be filtered over frames too",
            where=source,
            hint='choose another --reference, or --time-constant "0 s"',
        )
    back = np.flatnonzero(~(np.diff(time) > 0))
    if len(back) or not np.isfinite(time).all():
        at = int(back[0]) + 1 if len(back) else 0
        raise DataError(
            f"expected times that go on, for a filter over frames; got {time[at]:g} s",
            where=f"{source}, frame {at} of those that can be used",
            hint='give time_s, or --time-constant "0 s"',
        )
