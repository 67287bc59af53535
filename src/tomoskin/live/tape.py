"""What the runner tells a recorder, when there is one; and the beginning of a recording."""

from __future__ import annotations

import threading
from collections.abc import Callable
from pathlib import Path

from tomoskin.core import Event, Frame
from tomoskin.live.pipeline import REFERENCE_FRAMES
from tomoskin.live.prepare import Prepared
from tomoskin.live.published import epoch, glance
from tomoskin.live.result import Result
from tomoskin.session import Mark, Recorder, SessionWriter
from tomoskin.source import Link
from tomoskin.twin import Press
from tomoskin.wire import Info

_KEPT = 3 * REFERENCE_FRAMES
"""Frames from a reference's first on that a later recording begins with: those that made it, and
those during which the operator followed its noise."""


class Tape:
    """Passes everything on to the recorder of the moment, and remembers what a new one needs.

    The frames that made the reference are kept, so that a recording that begins later can be
    replayed with the same reference and operator. :meth:`record` and :meth:`stop` may come from
    any thread; the rest is the runner's.

    Parameters
    ----------
    prepared
        The skin and its mesh.
    say
        Called with the kind and text of what happens to a recording.
    clock
        Host monotonic seconds.
    """

    def __init__(
        self, prepared: Prepared, say: Callable[[str, str], None], clock: Callable[[], float]
    ) -> None:
        self._prepared, self._say, self._clock = prepared, say, clock
        self._recorder: Recorder | None = None
        self._reference: list[tuple[Frame, Mark]] = []
        self._info: Info | None = None
        self._truth: tuple[Press, ...] = ()
        self._source = ""
        self._changing = threading.Lock()

    @property
    def path(self) -> Path | None:
        """The file that is being written, or None."""
        recorder = self._recorder
        return recorder.path if recorder is not None and recorder.running else None

    def record(self, path: Path) -> None:
        """Begin to record, and end what was being recorded.

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
        now = self._clock()
        session = SessionWriter(path, self._prepared.skin, epoch=epoch(), start=now)
        recorder = Recorder(session, glance(self._prepared), self._say)
        recorder.settings(now, self._settings())
        recorder.truth(now, self._truth)
        for frame, mark in tuple(self._reference):
            recorder.frame(frame, mark | Mark.EARLIER)
        if self._info is not None:
            recorder.device(now, self._info)
        self._recorder = recorder
        self._say("recording", f"recording to {path}")

    def _end(self) -> None:
        recorder, self._recorder = self._recorder, None
        if recorder is not None:
            recorder.stop()
            if recorder.is_whole:
                self._say("recorded", f"recorded to {recorder.path}")

    def opened(self, source: str) -> None:
        """A source has been opened, and this is what it is called."""
        self._source = source
        if self._recorder:
            self._recorder.settings(self._clock(), self._settings())

    def read(self, host_time: float, data: bytes) -> None:
        """Bytes from the source."""
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
        self._remember(frame, mark)
        if self._recorder:
            self._recorder.frame(frame, mark)

    def result(self, result: Result) -> None:
        """What was made of a frame."""
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

    def truth(self, presses: tuple[Press, ...]) -> None:
        """What presses on the twin from now on."""
        self._truth = presses
        if self._recorder:
            self._recorder.truth(self._clock(), presses)

    def _settings(self) -> dict[str, object]:
        return {"source": self._source, "reference_frames": REFERENCE_FRAMES}

    def _remember(self, frame: Frame, mark: Mark) -> None:
        if mark & Mark.REFERENCE:
            self._reference = []
        left_out = mark & (Mark.HELD | Mark.SKIPPED)
        if not left_out and len(self._reference) < _KEPT:
            self._reference.append((frame, mark))
