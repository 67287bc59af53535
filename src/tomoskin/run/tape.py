"""What the runner tells a recorder, when there is one; and the beginning of a recording."""

from __future__ import annotations

import threading
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from tomoskin.core import Event, Frame
from tomoskin.pipeline import REFERENCE_FRAMES, Prepared, Result
from tomoskin.recording import Mark, Recorder, SessionWriter
from tomoskin.run.beginning import Beginning, Marked
from tomoskin.run.presses import described
from tomoskin.run.published import epoch, glance
from tomoskin.source import Link
from tomoskin.twin import Contact
from tomoskin.wire import Info


class Tape:
    """Passes everything on to the recorder of the moment, and remembers what a new one needs.

    A recording begins with frames that bring a replay to where the run is; see
    :class:`Beginning`. :meth:`record` and :meth:`stop` may come from any thread; the rest is the
    runner's.

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
        say: Callable[[str, str], None],
        clock: Callable[[], float],
        numbered: Callable[[], int],
    ) -> None:
        self._prepared, self._say, self._clock = prepared, say, clock
        self._numbered = numbered
        self._recorder: Recorder | None = None
        self._waiting: Recorder | None = None
        self._beginning = Beginning()
        self._again: tuple[Marked, ...] = ()
        self._touches_before = 0
        self._info: Info | None = None
        self._truth: tuple[tuple[Any, ...], tuple[Mapping[str, Any], ...]] = ((), ())
        self._source = ""
        self._changing = threading.Lock()

    @property
    def path(self) -> Path | None:
        """The file that is being written, or None."""
        recorder = self._waiting or self._recorder
        return recorder.path if recorder is not None and recorder.running else None

    def record(self, path: Path) -> None:
        """Begin to record with the next bytes, and end what was being recorded.

        Raises
        ------
        DataError
            When the file cannot be made.
        """
        with self._changing:
            self._end()
            self._begin(path)

    def stop(self) -> None:
        """End the recording, if there is one; returns when the file is whole."""
        with self._changing:
            self._end()

    def _begin(self, path: Path) -> None:
        session = SessionWriter(path, self._prepared.skin, epoch=epoch(), start=self._clock())
        for calibration in self._prepared.calibrations.values():
            session.attach(calibration.kind.attachment, "application/zip", calibration.encode())
        self._waiting = Recorder(session, glance(self._prepared), self._say)

    def _headed(self) -> None:
        """The recorder that waits gets what a replay begins with, and then everything."""
        recorder, self._waiting = self._waiting, None
        if recorder is None:
            return
        now = self._clock()
        frames, self._touches_before, again = self._beginning.begin(self._numbered())
        recorder.settings(now, self._settings())
        recorder.truth(now, *self._truth)
        for frame, mark in frames:
            recorder.frame(frame, mark | Mark.EARLIER)
        if self._info is not None:
            recorder.device(now, self._info)
        self._again = frames if again else ()
        self._recorder = recorder
        self._say("recording", f"recording to {recorder.path}")

    def _end(self) -> None:
        self._headed()
        recorder, self._recorder = self._recorder, None
        if recorder is not None:
            recorder.stop()
            if recorder.is_complete:
                self._say("recorded", f"recorded to {recorder.path}")

    def adopt(self, prepared: Prepared) -> None:
        """Other settings from here on; a recording ends, since it holds those of one skin."""
        with self._changing:
            self._end()
            self._prepared = prepared
            self._beginning.changed()

    @property
    def info(self) -> Info | None:
        """What the board said of itself."""
        return self._info

    def opened(self, source: str) -> None:
        """A source has been opened, and this is what it is called."""
        self._source = source
        if self._recorder:
            self._recorder.settings(self._clock(), self._settings())

    def read(self, host_time: float, data: bytes) -> None:
        """Bytes from the source."""
        if self._waiting:
            with self._changing:
                self._headed()
        if self._recorder:
            self._recorder.raw(host_time, data)

    def linked(self, link: Link) -> None:
        """The board has been asked what it is."""
        if link.info is not self._info:
            self._info = link.info
            if self._recorder and self._info:
                self._recorder.device(self._clock(), self._info)

    def frame(self, frame: Frame, mark: Mark) -> None:
        """A frame, and what becomes of it."""
        self._beginning.frame(frame, mark, self._numbered())
        if self._recorder:
            self._recorder.frame(frame, mark)

    def again(self) -> tuple[Marked, ...]:
        """Frames that the pipeline is to take again before the next, as a replay will."""
        frames, self._again = self._again, ()
        return frames

    def result(self, result: Result) -> None:
        """What was made of a frame."""
        self._beginning.result(result)
        if self._recorder and result.ready:
            self._recorder.result(result.host_time, result.sequence, result.image, result.touches)

    def event(self, event: Event) -> None:
        """Something that happened."""
        if self._recorder:
            self._recorder.event(event)

    def note(self, event: Event) -> None:
        """A person's remark; from any thread."""
        recorder = self._recorder
        if recorder:
            recorder.note(event.host_time, event.text)

    def truth(
        self, presses: tuple[Contact, ...], bends: tuple[Mapping[str, Any], ...] = ()
    ) -> None:
        """What presses on the twin, and how it is bent, from now on."""
        self._truth = tuple(map(described, presses)), bends
        if self._recorder:
            self._recorder.truth(self._clock(), *self._truth)

    def _settings(self) -> dict[str, object]:
        return {
            "source": self._source,
            "reference_frames": REFERENCE_FRAMES,
            "touches_before": self._touches_before,
        }
