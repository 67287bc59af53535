"""A recorded session through the pipeline again, without a clock: the same touches to the bit."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from tomoskin.core import DataError, Frame
from tomoskin.files.session.layout import Mark
from tomoskin.files.session.session_reader import SessionReader, tick_rate, touches_before
from tomoskin.learning import KINDS, Calibration
from tomoskin.pipeline import FrameResult, Pipeline, Prepared, prepare


def as_recorded(session: SessionReader) -> Prepared:
    """The session's own skin, with the calibrations that were on. Raises DataError."""
    prepared = prepare(session.skin)
    for calibration in recorded_calibrations(session):
        prepared = prepared.calibrated(calibration)
    return prepared


def recorded_calibrations(session: SessionReader) -> Iterator[Calibration[Any]]:
    """The calibrations that were on, in the order in which they are applied. Raises DataError."""
    held = session.attachments()
    for kind in KINDS:
        if (data := held.get(kind.attachment)) is not None:
            yield kind.decode(data, f"{session.path}, {kind.attachment}")


def advance(pipeline: Pipeline, frame: Frame, mark: Mark) -> FrameResult | None:
    """Give the pipeline one frame as its ``mark`` says; None where there is no picture of it.

    Raises
    ------
    DataError
        When the frame has another number of samples than the scan.
    """
    if mark & Mark.SKIPPED:
        return None
    if mark & Mark.REFERENCE:
        pipeline.take_reference()
    pipeline.paused = bool(mark & Mark.HELD)
    return pipeline.push(frame)


def replayed(prepared: Prepared, session: SessionReader) -> Iterator[FrameResult]:
    """What the pipeline made of every frame of ``session``, and makes of it again.

    ``prepared`` is that of the session's own skin for the same touches, or of another with the
    same scan. Frames that the pipeline refused are refused again.
    """
    pipeline = Pipeline(prepared)
    pipeline.tick_rate = tick_rate(session)
    pipeline.number_after(touches_before(session))
    for item in session.frames():
        try:
            result = advance(pipeline, item.frame, item.mark)
        except DataError:
            continue
        if result is not None and not item.mark & Mark.EARLIER:
            yield result
