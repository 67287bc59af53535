"""A recorded session through the pipeline again, without a clock: the same touches to the bit;
and a session for those who compute with it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from functools import cached_property, reduce
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from threadpoolctl import ThreadpoolController

from tomoskin.core import DataError, Mark, StrPath
from tomoskin.files.messages import DeformedFrame
from tomoskin.files.session import scanned
from tomoskin.files.session.session_reader import (
    SessionReader,
    indexed_frames,
    message_counts,
    reference_frames,
    tick_rate,
    touches_before,
)
from tomoskin.learning import Calibration, calibration_kinds
from tomoskin.model.mesh import Mesh
from tomoskin.model.pattern import Scan
from tomoskin.pipeline import (
    FrameResult,
    Gathered,
    Pipeline,
    Prepared,
    Reconstruction,
    Setting,
    prepare,
)
from tomoskin.sensing.signal import Recording
from tomoskin.sensing.track import TouchedFrame, measured_in, touch_columns


def as_recorded(session: SessionReader, previous: Prepared | None = None) -> Prepared:
    """The session's own skin, with the calibrations that were on. Raises DataError.

    Of ``previous``, what the session has too serves again: it is not learnt and tabulated anew.
    """
    known = previous.calibrations if previous else {}
    prepared = prepare(session.skin, previous.uncalibrated() if previous else None)
    return reduce(Prepared.calibrated, recorded_calibrations(session, known), prepared)


def recorded_calibrations(
    session: SessionReader, known: Mapping[str, Calibration[Any]] | None = None
) -> Iterator[Calibration[Any]]:
    """The calibrations that were on, in the order in which they are applied. Raises DataError.

    Those that are ``known``, by the name of their kind, to the byte are not learnt again.
    """
    held = session.attachments()
    for kind in calibration_kinds():
        if (data := held.get(kind.attachment)) is not None:
            same = (known or {}).get(kind.name)
            if same is not None and same.encode() == data:
                yield same
            else:
                yield kind.decode(data, f"{session.path}, {kind.attachment}")


def replaying(
    prepared: Prepared,
    session: SessionReader,
    setting: Setting | None = None,
    idle: int | None = None,
) -> Pipeline:
    """A pipeline that begins where that of the run began; ``setting``: unless it is a live one.

    ``idle``: frames that make its reference, where not as many as in the run.
    """
    needed = reference_frames(session.settings()) if idle is None else idle
    pipeline = Pipeline(prepared, reference_frames=needed, setting=setting)
    pipeline.tick_rate = tick_rate(session)
    pipeline.number_after(touches_before(session))
    return pipeline


def gathered(
    pipeline: Pipeline, session: SessionReader, scan: Scan, *, marked: bool = True
) -> Iterator[tuple[scanned.ScannedFrame, FrameResult | None]]:
    """Every frame of ``scan`` but those from before the recording, and what ``pipeline`` makes of
    it: None where it was held, skipped or refused. Not ``marked``: as if the run had followed all
    of them, from one reference on."""
    threads = ThreadpoolController()
    for frame in scanned.timed(session.frames(), tick_rate(session), scan):
        mark = frame.item.mark if marked else Mark.NONE
        try:
            with threads.limit(limits=1):  # as live, so that sums keep their order
                result = pipeline.push(frame.item.frame, mark)
        except DataError:
            result = None
        if not frame.item.mark & Mark.EARLIER:
            yield frame, result


def replayed(prepared: Prepared, session: SessionReader) -> Iterator[FrameResult]:
    """What the pipeline made of every frame of ``session``, and makes of it again.

    ``prepared`` is that of the session's own skin for the same touches, or of another with the
    same scan. Frames that the pipeline refused are refused again.
    """
    for _, result in gathered(replaying(prepared, session), session, prepared.scan):
        if result is not None:
            yield result


def session_touches(session: SessionReader) -> Iterator[TouchedFrame]:
    """(frame, time, touches) as they were recorded; as a replay tells them where none were."""
    counts = message_counts(session)
    if counts["/touches"] or counts["/image"]:
        yield from scanned.scanned_touches(session)
        return
    for frame, result in _again(session):
        if result.touches:
            yield frame.number, frame.time, result.touches


def session_deformations(session: SessionReader) -> Iterator[DeformedFrame]:
    """(frame, time, deformation) as they were recorded; as a replay tells them where neither
    touches nor images were."""
    counts = message_counts(session)
    if counts["/touches"] or counts["/image"]:
        yield from scanned.scanned_deformations(session)
        return
    for frame, result in _again(session):
        yield frame.number, frame.time, result.deformation


def _again(session: SessionReader) -> Iterator[tuple[scanned.ScannedFrame, FrameResult]]:
    """Each frame that the pipeline takes, and what it makes of it again."""
    prepared = as_recorded(session)
    for frame, result in gathered(replaying(prepared, session), session, prepared.scan):
        if result is not None:
            yield frame, result


def reconstruct_session(
    prepared: Prepared,
    session: SessionReader,
    *,
    start: int = 0,
    stop: int | None = None,
    setting: Setting | None = None,
    idle: int | None = None,
    advance: scanned.Advance = scanned.no_report,
) -> Reconstruction:
    """A whole session as its replay tells it, to the bit; ``unseen`` are the frames that the run
    held or skipped.

    Parameters
    ----------
    start, stop
        Numbers of the frames that are wanted; all before run through the pipeline all the same.
    setting
        How frames are followed: as they are live, or another way.
    idle
        So many frames, from the first one on, are the reference, and all others are followed,
        whatever was done in the run. None: as in the run.

    Raises
    ------
    DataError
        When the session is of another scan than the skin, or too short for a reference.
    """
    if setting is not None:
        setting = replace(setting, scan=prepared.scan)
    pipeline, without, ended = replaying(prepared, session, setting, idle), list[int](), False
    total = indexed_frames(session)

    def wanted() -> Iterator[Gathered]:
        nonlocal ended
        for frame, result in gathered(pipeline, session, prepared.scan, marked=idle is None):
            if stop is not None and frame.number >= stop:
                break
            advance(frame.number, max(total, frame.number + 1))
            if frame.number < start:
                continue
            if result is None:
                without.append(frame.number)
            else:
                yield Gathered(frame.number, frame.time, result)
        else:
            ended = True

    whole = Reconstruction.of(pipeline, prepared, wanted())
    if ended and pipeline.reference is None:
        state = pipeline.reference_state
        raise DataError(
            f"holds too few frames for a reference: {state.frames} of {state.needed}",
            where=str(session.path),
            hint="choose untouched frames with --reference",
        )
    return replace(whole, unseen=np.array(without, dtype=np.int64))


class Session:
    """A recorded session; iterate over it for what the pipeline makes of each frame.

    Every loop begins at the first frame and gives the same results, those of the live run to the
    bit. Until the reference stands, ``ready`` of a frame is False. The file is open only while it
    is read.

    Parameters
    ----------
    path
        The file, such as "run.mcap".

    Attributes
    ----------
    path
        The file.
    skin
        The skin that it was recorded with.

    Raises
    ------
    DataError
        When the file cannot be read, is no session, or is damaged; from every method.
    """

    def __init__(self, path: StrPath) -> None:
        self.path = Path(path)
        with SessionReader(self.path) as reader:
            self.skin = reader.skin

    def __iter__(self) -> Iterator[FrameResult]:
        """Frame by frame: voltages, image, touches."""
        with SessionReader(self.path) as reader:
            yield from replayed(self.prepared, reader)

    @property
    def mesh(self) -> Mesh:
        """The mesh that the images live on."""
        return self.prepared.mesh

    @cached_property
    def prepared(self) -> Prepared:
        """What the pipeline needs of the skin and of the calibrations that were on."""
        with SessionReader(self.path) as reader:
            return as_recorded(reader)

    def voltages(self) -> Recording:
        """All frames at once, as voltages in the order of the skin's pattern."""
        return scanned.read_session(self.path)

    def touches(self) -> dict[str, NDArray[np.generic]]:
        """All touches as columns, one row a touch, as ``pandas.DataFrame`` takes them.

        The columns are those of :func:`tomoskin.sensing.track.touch_columns`.
        """
        with SessionReader(self.path) as reader:
            pipeline = replaying(self.prepared, reader)
            frames = [
                (frame.number, frame.time, result.touches)
                for frame, result in gathered(pipeline, reader, self.prepared.scan)
                if result is not None
            ]
        return touch_columns(frames, self.skin.surface, measured=measured_in(frames))
