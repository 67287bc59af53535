"""The frame flow over a recording: the pipeline's own results, gathered without a clock."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from threadpoolctl import threadpool_limits

from tomoskin.core import DataError, FloatArray, Image, IntArray, Touch, Voltages, check_fits
from tomoskin.imaging import AlphaChoice
from tomoskin.pipeline.following import Setting
from tomoskin.pipeline.frame_result import FrameResult, ModelAgreement
from tomoskin.pipeline.pipeline import Pipeline
from tomoskin.pipeline.prepare import Prepared
from tomoskin.pipeline.recorded import Idle, RecordedFrames, recorded_frames
from tomoskin.pipeline.rest import tuned_by_file, tuned_by_rule
from tomoskin.sensing.fit import EXHAUSTIVE, Deformation
from tomoskin.sensing.signal import Recording

Advance = Callable[[float, float], None]
"""Called with how many frames of how many are done."""


class Gathered(NamedTuple):
    """What the pipeline made of a frame: its ``number`` in the recording, and its ``time``, s."""

    number: int
    time: float
    result: FrameResult


@dataclass(frozen=True, eq=False)
class Reconstruction:
    """Images and touches of a recording.

    Attributes
    ----------
    frames, time
        (n,) indices in the recording of the frames that were taken, and when they were scanned, s.
    rows_missing
        (n,) number of rows that each of them lacks beside ``rows_left_out``: they were filled in
        so that they do not count.
    left_out, unseen
        (k,) indices of those of them that show no image, as most of their rows are lacking or all
        changed at once, and of others, which a run held or skipped.
    shown
        The images, computed where somebody looks at them; see :attr:`images`.
    unit
        Of the images.
    touches
        One tuple a frame.
    model_agreement
        Of the reference with the model's voltages.
    choice
        The alpha of the images, and what chose it.
    rows_left_out
        (r,) rows of the pattern that are left out of every image.
    notes
        Why they are, in sentences.
    readings
        What the skin's calibrations read, by the name of their kind: one a frame, None where too
        little was left of it.
    deformations
        How the sheet is deformed in each frame; None where it is not.
    problems
        What was likely the matter with frames, in a sentence each, and with which of them.
    """

    frames: IntArray
    time: FloatArray
    rows_missing: IntArray
    left_out: IntArray
    shown: tuple[Image, ...]
    unit: str
    touches: tuple[tuple[Touch, ...], ...]
    model_agreement: ModelAgreement
    choice: AlphaChoice
    rows_left_out: IntArray
    readings: Mapping[str, tuple[Any, ...]] = field(default_factory=dict)
    deformations: tuple[Deformation | None, ...] = ()
    problems: Mapping[str, tuple[int, ...]] = field(default_factory=dict)
    unseen: IntArray = field(default_factory=lambda: np.zeros(0, dtype=np.int64))
    notes: tuple[str, ...] = ()

    @classmethod
    def of(
        cls, pipeline: Pipeline, prepared: Prepared, frames: Iterable[Gathered]
    ) -> Reconstruction:
        """What ``pipeline`` made of some ``frames``, which are asked for one by one."""
        kept: list[tuple[Any, ...]] = []
        left_out: list[int] = []
        problems: dict[str, list[tuple[str, int]]] = {}
        for number, time, result in frames:
            contents = result.touches, result.readings, result.deformation
            kept.append((number, time, result.left_out, result.image, *contents))
            if not result.has_image:
                left_out.append(number)
            if (diagnosis := result.diagnosis) is not None:
                problems.setdefault(diagnosis.key, []).append((diagnosis.text, number))
        numbers, times, missing, shown, touches, readings, deformations = (
            zip(*kept, strict=True) if kept else 7 * ((),)
        )
        return cls(
            frames=np.array(numbers, dtype=np.int64),
            time=np.array(times, dtype=np.float64),
            rows_missing=np.array(missing, dtype=np.int64),
            left_out=np.array(left_out, dtype=np.int64),
            shown=shown,
            unit=prepared.operator.unit,
            touches=touches,
            model_agreement=pipeline.reference_state.agreement,
            choice=pipeline.choice,
            rows_left_out=np.zeros(0, dtype=np.int64),
            readings={k: tuple(r.get(k) for r in readings) for k in prepared.calibrations},
            deformations=deformations,
            problems={
                some[len(some) // 2][0]: tuple(number for _, number in some)
                for some in problems.values()
            },
        )

    @property
    def images(self) -> FloatArray:
        """(n, n_cells) change of conductivity, in ``unit``; DataError where memory is too small."""
        n_cells = len(self.shown[0].values) if self.shown else 0
        check_fits(8 * len(self.shown) * n_cells, f"images of {len(self.shown)} frames")
        return np.array([image.values for image in self.shown])

    @property
    def agreement(self) -> float:
        """Cosine between the reference and the model's voltages, NaN where there is none."""
        return self.model_agreement.cosine


ALONE = Setting(pace=EXHAUSTIVE, alone=True)
"""Each frame searched as if it were the only one: more than a live frame has time for."""


def reconstruct(
    prepared: Prepared,
    recording: Recording,
    idle: Idle,
    *,
    start: int = 0,
    stop: int | None = None,
    rule: str | None = None,
    setting: Setting | None = None,
    advance: Advance = lambda _done, _total: None,
) -> Reconstruction:
    """What the pipeline makes of ``recording``, whose rows are in the pattern's order.

    The flow is that of a live run which brings the same voltages at the same times. The frames of
    its own that make the reference show nothing, and nothing is learnt of them twice.

    Parameters
    ----------
    idle
        What the frames are held against; see :data:`Idle`.
    start, stop
        The frames that are wanted; those before ``start`` run through the pipeline all the same.
    rule
        Chooses alpha from this recording, by a name of :data:`tomoskin.imaging.RULES`; without
        it the skin's alpha holds, and "auto" follows the noise of the idle frames as it does live,
        or :func:`tuned_by_file` where another board recorded it.
    setting
        How frames are followed: as they are live, or :data:`ALONE`, which holds where frames have
        no times.
    advance
        Called with how many frames of how many are done.

    Raises
    ------
    DataError
        When the rows are not in the pattern's order, the reference does not look like this
        skin, too few frames or rows are left, or the recording lacks what the rule, or a filter
        over frames, needs.
    ModelError
        When the rule is not known or finds no alpha.
    """
    if not isinstance(recording, Recording):
        raise DataError(
            f"expected a Recording, got {type(recording).__name__}",
            hint="write the array with its tables to an .npz file, and give "
            "read_recording(file).in_order_of(pattern); docs/python.md shows it",
        )
    recorded = recorded_frames(prepared, recording, idle)
    prepared = recorded.prepared
    if prepared.modes is not None:
        _check_follows(recording, idle)
    setting = setting or (Setting() if recording.timed else ALONE)
    if rule is not None:
        prepared = tuned_by_rule(prepared, rule, recorded.noise)
    elif not recording.board_known:
        prepared = tuned_by_file(prepared, recorded.reference, recorded.differences)
    pipeline = Pipeline(
        prepared,
        reference_frames=len(recorded.idle),
        setting=replace(setting, rounding=recorded.rounding, interval=recorded.interval),
    )
    stop = len(recording) if stop is None else stop
    wanted = (recorded.frames >= start) & (recorded.frames < stop)
    with threadpool_limits(1):  # as live, so that sums keep their order
        flow = sorted(_flow(pipeline, recorded, stop, advance))
    whole = Reconstruction.of(pipeline, prepared, (one for one in flow if one.number >= start))
    return replace(
        whole,
        rows_missing=recorded.missing[wanted].sum(axis=1),
        model_agreement=recorded.agreement,
        rows_left_out=recorded.rows_left_out,
        notes=recorded.notes,
    )


def _check_follows(recording: Recording, idle: Idle) -> None:
    """Raises DataError where a filter over the frames makes no sense."""
    if isinstance(idle, str):
        raise DataError(
            "differences to the previous frame cannot be filtered over frames as well",
            where=recording.source,
            hint='choose another --reference, or --time-constant "0 s"',
        )
    if not recording.timed:
        raise DataError(
            "holds no times of its frames, which a filter over them needs",
            where=recording.source,
            hint='give them as time_s, or use --time-constant "0 s"',
        )


def _flow(
    pipeline: Pipeline, recorded: RecordedFrames, stop: int, advance: Advance
) -> Iterator[Gathered]:
    """First the reference, then all other frames before ``stop``, in their order."""
    for values, number, time in zip(
        recorded.idle, recorded.idle_frames, recorded.idle_time, strict=True
    ):
        none: NDArray[np.bool_] = np.zeros(len(values), bool)
        result = pipeline.follow(Voltages(values, none, time, time, max(number, 0)))
        if 0 <= number < stop:
            yield Gathered(number, time, result)
    rest = np.flatnonzero(
        ~np.isin(recorded.frames, recorded.idle_frames) & (recorded.frames < stop)
    )
    for done, k in enumerate(rest.tolist(), start=1):
        number, time = int(recorded.frames[k]), float(recorded.time[k])
        measured = Voltages(recorded.values[k], recorded.missing[k], time, time, number)
        yield Gathered(number, time, pipeline.follow(measured))
        advance(done, len(rest))
