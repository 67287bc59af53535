"""The frame flow over a recording: reference, images and touches without a clock."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from tomoskin.core import DataError, FloatArray, IntArray, Touch, check_fits
from tomoskin.imaging import AlphaChoice
from tomoskin.learning import BENDS, CLASSES, BendReading, ClassReading
from tomoskin.pipeline.collecting import Rest
from tomoskin.pipeline.following import Following, Setting
from tomoskin.pipeline.model_agreement import ModelAgreement
from tomoskin.pipeline.prepare import Prepared
from tomoskin.pipeline.recorded import Idle, RecordedFrames, recorded_frames
from tomoskin.pipeline.records import Measured
from tomoskin.pipeline.tune import tuned, tuned_by_rule
from tomoskin.sensing.signal import Recording
from tomoskin.sensing.track import STILL, Tracker


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
    model_agreement
        Of the reference with the model's voltages.
    choice
        The alpha of the images, and what chose it.
    rows_left_out
        (r,) rows of the pattern that hold no finite values, left out of every image.
    readings
        What the skin's calibrations read, by the name of their kind: one a frame, None where too
        little was left of it.
    """

    frames: IntArray
    rows_missing: IntArray
    left_out: IntArray
    images: FloatArray
    unit: str
    touches: tuple[tuple[Touch, ...], ...]
    model_agreement: ModelAgreement
    choice: AlphaChoice
    rows_left_out: IntArray
    readings: Mapping[str, tuple[Any, ...]] = field(default_factory=dict)

    @property
    def agreement(self) -> float:
        """Cosine between the reference and the model's voltages, NaN where there is none."""
        return self.model_agreement.cosine

    @property
    def bends(self) -> tuple[BendReading | None, ...]:
        """How the sheet was bent in each frame; empty where its bends were not learnt."""
        return self.readings.get(BENDS.name, ())

    @property
    def classes(self) -> tuple[ClassReading | None, ...]:
        """The class of each frame; empty where none were learnt."""
        return self.readings.get(CLASSES.name, ())

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
        Chooses alpha from this recording, by a name of :data:`tomoskin.imaging.RULES`; without
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
    recorded = recorded_frames(prepared, recording, idle)
    prepared = _tuned(recorded, rule)
    time = recording.time[recorded.frames]
    if prepared.modes is not None:
        _check_times(time, idle, recording.source)
    following = _following(prepared, recorded, time)
    images = _room(len(time), len(prepared.mesh.cells), recording.source)
    touches, readings = [], []
    for number, now in enumerate(time.tolist()):
        values, missing = recorded.values[number], recorded.missing[number]
        result = following.push(Measured(values, missing, now, now, number))
        images[number] = result.image.values
        touches.append(result.touches)
        readings.append(result.readings)
        advance(number + 1, len(time))
    return Reconstruction(
        frames=recorded.frames,
        rows_missing=recorded.missing.sum(axis=1),
        left_out=recorded.left_out,
        images=images,
        unit=prepared.operator.unit,
        touches=tuple(touches),
        model_agreement=recorded.agreement,
        choice=prepared.choice,
        rows_left_out=recorded.rows_left_out,
        readings={
            kind: tuple(reading.get(kind) for reading in readings) for kind in prepared.calibrations
        },
    )


def _room(n_frames: int, n_cells: int, source: str) -> FloatArray:
    """(n_frames, n_cells) for images; DataError where they are too many for memory."""
    check_fits(8 * n_frames * n_cells, f"{source}, images of {n_frames} frames")
    return np.empty((n_frames, n_cells))


def _tuned(recorded: RecordedFrames, rule: str | None) -> Prepared:
    if rule is not None:
        return tuned_by_rule(recorded.prepared, rule, recorded.evidence())
    if recorded.reference is None:
        return recorded.prepared
    return tuned(recorded.prepared, recorded.reference)


def _following(prepared: Prepared, recorded: RecordedFrames, time: FloatArray) -> Following:
    """The state that the pipeline is in from the idle frames on."""
    tracker = Tracker(replace(STILL, snr=prepared.skin.touch.snr))
    if recorded.reference is None:
        return Following.of_differences(prepared, tracker)
    interval = float(np.median(np.diff(time))) if len(time) > 1 else np.nan
    rest = Rest(recorded.reference, np.zeros(prepared.pattern.n_meas, bool), interval)
    return Following.from_rest(prepared, rest, tracker, Setting())


def _check_times(time: FloatArray, idle: Idle, source: str) -> None:
    """Raises DataError where a filter over the frames makes no sense."""
    if isinstance(idle, str):
        raise DataError(
            "differences to the previous frame cannot be filtered over frames as well",
            where=source,
            hint='choose another --reference, or --time-constant "0 s"',
        )
    back = np.flatnonzero(~(np.diff(time) > 0))
    if len(back) or not np.isfinite(time).all():
        at = int(back[0]) + 1 if len(back) else 0
        raise DataError(
            f"expected increasing times for a filter over frames, got {time[at]:g} s",
            where=f"{source}, usable frame {at}",
            hint='give the times as time_s, or use --time-constant "0 s"',
        )
