"""Recordings of a run, and the frames that they begin with."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from concurrent.futures import Future
from dataclasses import replace
from pathlib import Path

from tomoskin.core import Capacity, Frame, Mark, MarkedFrame, Worker
from tomoskin.files import session
from tomoskin.files.messages import epoch, raster
from tomoskin.pipeline import REFERENCE_FRAMES, FrameResult, Prepared

_KEPT = 3 * REFERENCE_FRAMES
"""Frames that make a reference, and during which the operator follows its noise."""

FILE_NAME = "tomoskin-%Y%m%d-%H%M%S.mcap"
"""Of a recording that nobody has named."""

_DELAY = 3
"""A touch is certain only when it has stood for so many frames."""

Marked = tuple[Frame, Mark]


class PreRoll:
    """Remembers frames of a run that bring a new pipeline to where the run's is.

    Until ``_KEPT`` frames after a reference these are all frames since. Later the pipeline has
    learnt more than any file would hold: then it is the newest untouched frames, and the run's
    own pipeline takes them for a new reference too, at the frame at which the recording begins.
    """

    def __init__(self) -> None:
        """Make a pre-roll that holds no frames yet."""
        self._since: list[Marked] = []
        self._complete = True
        self._number = 0
        self._untouched: deque[Frame] = deque(maxlen=_KEPT)
        self._waiting: deque[Frame] = deque()
        self._newest: Frame | None = None

    def frame(self, frame: Frame, mark: Mark, number: int) -> None:
        """A frame and what becomes of it, before the pipeline has it; ``number``: the last identity
        that it has given to a touch."""
        self._newest = None
        if mark & Mark.REFERENCE:
            self._since, self._complete, self._number = [], True, number
            self._untouched.clear()
            self._waiting.clear()
        if mark & (Mark.HELD | Mark.SKIPPED):
            return
        self._newest = frame
        if len(self._since) < _KEPT:
            self._since.append((frame, mark))
        else:
            self._complete = False

    def result(self, result: FrameResult) -> None:
        """What was made of that frame."""
        if self._newest is None or not result.ready or not result.has_image:
            return
        if result.touches or (result.baseline is not None and result.baseline.held):
            self._waiting.clear()
            return
        if not all(reading.is_rest for reading in result.shown_readings.values()):
            return
        self._waiting.append(self._newest)
        if len(self._waiting) > _DELAY:
            self._untouched.append(self._waiting.popleft())

    def invalidate(self) -> None:
        """The pipeline is no longer what these frames would make of a new one."""
        self._complete = False

    def begin(self, number: int) -> tuple[tuple[Marked, ...], int, bool]:
        """Frames, the last identity before them, and whether the run must go through them too."""
        if self._complete:
            return tuple(self._since), self._number, False
        if len(self._untouched) >= REFERENCE_FRAMES:
            marks = [Mark.REFERENCE] + [Mark.NONE] * (len(self._untouched) - 1)
            self._since = list(zip(self._untouched, marks, strict=True))
        self._since = self._since[:_KEPT]
        self._complete, self._number = True, number
        return tuple(self._since), number, True


MOST_WAITING = 50_000
"""Messages that may wait for the disk: about a minute of the fastest board."""

Say = Callable[[str, str], None]


class Recordings:
    """Gives the recorder of the moment what the run says; used by the runner's thread.

    A recording begins with the next bytes from the source, and with a pre-roll: frames that bring
    a replay to where the run is (:class:`PreRoll`).

    Parameters
    ----------
    prepared
        The skin and its mesh.
    say
        Called with the kind and text of what happens to a recording.
    clock
        Host monotonic seconds.
    numbered
        The last identity that was given to a touch.
    """

    def __init__(
        self,
        prepared: Prepared,
        say: Say,
        clock: Callable[[], float],
        numbered: Callable[[], int],
    ) -> None:
        self._prepared, self._say, self._clock = prepared, say, clock
        self._numbered = numbered
        self._current: Worker[session.Recorder] | None = None
        self._awaiting: Worker[session.Recorder] | None = None
        self._pre_roll = PreRoll()
        self._again: tuple[Marked, ...] = ()
        self._touches_before = 0
        self._info: session.BoardInfo | None = None
        self._truth = session.Truth(0.0, ())
        self._source = ""

    @property
    def path(self) -> Path | None:
        """The file that is being written, or None."""
        worker = self._awaiting or self._current
        return None if worker is None or worker.ending.done() else worker.consumer.path

    @property
    def frames(self) -> int:
        """How many have been given to the recording."""
        worker = self._current
        return 0 if worker is None else worker.consumer.frames

    def begin(
        self, path: Path, log: session.MessageLog | None = None, most: int | None = None
    ) -> Future[None]:
        """Record from the next bytes on, at ``most`` so many frames, and end what was recorded.

        ``log``: where it goes, instead of a file of its own. Done when the file has been made;
        DataError where it cannot be.
        """
        self.end()
        worker = self._awaiting = self._worker(path, log, most)
        worker.start()
        return worker.opening

    def end(self) -> Future[None] | None:
        """End the recording; done when the file is complete. None where there is none."""
        self._head()
        worker = self._current or self._awaiting
        self._current = self._awaiting = None
        if worker is None:
            return None
        worker.end()
        return worker.ending

    def adopt(self, prepared: Prepared) -> Future[None] | None:
        """Other settings from here on; a recording ends, since it holds those of one skin."""
        ended = self.end()
        self._prepared = prepared
        self._pre_roll.invalidate()
        return ended

    def name_source(self, source: str) -> None:
        """A source has been opened, and this is what it is called."""
        self._source = source
        if self._current:
            self._current.put(self._settings())

    def put(self, message: session.RunMessage) -> None:
        """Have it recorded, and remember what a new recording needs; events from any thread."""
        match message:
            case session.RawRead() if self._awaiting is not None:
                self._head()
            case MarkedFrame():
                self._pre_roll.frame(message.frame, message.mark, self._numbered())
            case FrameResult():
                self._pre_roll.result(message)
            case session.BoardInfo():
                self._info = message
            case session.Truth():
                self._truth = message
        if (current := self._current) is not None:
            current.put(message)

    def again(self) -> tuple[Marked, ...]:
        """Frames that the pipeline is to take again before the next, as a replay will."""
        frames, self._again = self._again, ()
        return frames

    def _head(self) -> None:
        """The recorder whose file has been made gets what a replay begins with."""
        worker = self._awaiting
        if worker is None or not worker.opening.done():
            return
        if worker.opening.exception() is not None:
            self._awaiting = None
            return
        now = self._clock()
        frames, self._touches_before, again = self._pre_roll.begin(self._numbered())
        worker.put(self._settings())
        worker.put(session.Truth(now, self._truth.presses, self._truth.bends))
        for frame, mark in frames:
            worker.put(MarkedFrame(frame, mark | Mark.EARLIER))
        if self._info is not None:
            worker.put(replace(self._info, host_time=now))
        self._again = frames if again else ()
        self._current, self._awaiting = worker, None  # in this order: `path` is read meanwhile
        self._say("recording", f"recording to {worker.consumer.path}")

    def _settings(self) -> session.RunSettings:
        return session.RunSettings(
            self._clock(),
            {
                "source": self._source,
                "reference_frames": REFERENCE_FRAMES,
                "touches_before": self._touches_before,
            },
        )

    def _worker(
        self, path: Path, log: session.MessageLog | None, most: int | None
    ) -> Worker[session.Recorder]:
        prepared, start = self._prepared, self._clock()

        def make() -> session.SessionWriter:
            writer = session.SessionWriter(path, prepared.skin, epoch=epoch(), start=start, log=log)
            for calibration in prepared.calibrations.values():
                writer.attach(calibration.kind.attachment, "application/zip", calibration.encode())
            return writer

        recorder = session.Recorder(path, make, raster(prepared), self._say, most)
        return Worker(recorder, Capacity(MOST_WAITING, "oldest"), self._say)
