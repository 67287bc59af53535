"""What of a run leaves the program, and when: the same for every sink and every file."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

from tomoskin.core import Event
from tomoskin.files.messages.contacts import Contacts, without_frame
from tomoskin.files.messages.stream import Stream
from tomoskin.pipeline import FrameResult

HEARTBEAT = 1.0
"""Seconds, by host time, after which touches are sent though nothing has changed."""

IMAGE_PERIOD = 0.1
"""Seconds between two images, by host time."""

WAITING = "waiting for the first frame"
"""What is wrong before it has come."""

LOST = frozenset({"source-lost", "no-answer", "silent", "fault", "reset", "paused"})
"""Kinds of events after which no frame is told until the board is well again, or goes on."""

Item = Contacts | Event
"""What every sink and every file of other programs takes, one after the other."""


@dataclass
class Every:
    """Says when a ``period`` of so many s has gone by, or the time has been set back."""

    period: float
    _last: float = float("-inf")

    def __call__(self, time: float) -> bool:
        """Whether it is due at ``time``; the next period begins then."""
        if 0 <= time - self._last < self.period:
            return False
        self._last = time
        return True


class Reporter:
    """Makes the contacts of each frame, and says what of them is worth sending.

    A touch or a deformation that begins or ends is sent at once, and so is whether touches are
    valid; what they do meanwhile every ``period`` s. Of frames with neither one a second is sent:
    who listens can tell a skin that nothing touches from one that is silent. Before the first frame
    it is said that touches are not valid, at once and then once a second. A lost source has one
    last message of that, and a report once a second.

    Parameters
    ----------
    stream
        Which skin it is.
    period, image_period
        Seconds between two messages of touches that go on, and between two images.
    """

    def __init__(
        self, stream: Stream, *, period: float = 0.0, image_period: float = IMAGE_PERIOD
    ) -> None:
        self.stream, self.period = stream, period
        self._image_is_due, self._report_is_due = Every(image_period), Every(HEARTBEAT)
        self._state: tuple[object, ...] = ()
        self._sent = float("-inf")
        self._valid: bool | None = None
        self._newest: Contacts | None = None
        self._is_lost = False

    def of(self, result: FrameResult, *, with_image: bool = True) -> Contacts:
        """The contacts of a frame; ``with_image``: where it is time for one."""
        whole, self._is_lost = Contacts.of(self.stream, result), False
        shown = with_image and whole.valid and self._image_is_due(whole.host_time)
        return self._paced(whole, image=whole.image if shown else None)

    def lost(self, event: Event) -> Contacts | None:
        """What a source that is lost says last; None where ``event`` says no such thing."""
        if event.kind not in LOST:
            return None
        self._is_lost = True
        now = self._now(event.host_time)
        if self._newest is None:
            return self._paced(without_frame(self.stream, event.text, now))
        last = self._newest.outdated(event.text)
        return self._paced(
            replace(last, host_time=now, scanned=math.nan, scan_time=math.nan, latency=None)
        )

    def silent(self) -> Contacts | None:
        """A report before the first frame, and of a source that is lost; None while frames come."""
        newest, clock = self._newest, self.stream.clock
        if not self._is_lost and (newest is None or newest.sequence < 0):
            if clock is None:  # a recording is ready
                return None
            waiting = self._paced(without_frame(self.stream, WAITING, clock()))
            return replace(waiting, is_due=True, reports=True)
        if not self._is_lost or newest is None:
            return None
        now = self._now(newest.host_time)
        return replace(self._paced(replace(newest, host_time=now, scanned=math.nan)), reports=True)

    def repeat(self) -> None:
        """Send what comes next whatever was sent before, since somebody new listens."""
        self._state, self._valid = (), None

    def _now(self, otherwise: float) -> float:
        """The time of the stream; of a replay that of its last frame."""
        if self.stream.clock is not None:
            return self.stream.clock()
        return otherwise if self._newest is None else self._newest.host_time

    def _paced(self, whole: Contacts, **changes: Any) -> Contacts:
        state: tuple[object, ...]
        if self._is_lost:
            state, period = (whole.problem,), math.inf
        else:
            deformation = whole.deformation
            state = (
                whole.valid,
                deformation and deformation.kind,
                *(touch.id for touch in whole.tracked),
            )
            period = self.period if whole.tracked or deformation else HEARTBEAT
        is_due = state != self._state or not 0 <= whole.host_time - self._sent < period
        if is_due:
            self._state, self._sent = state, whole.host_time
        reports = self._report_is_due(whole.host_time) or whole.valid is not self._valid
        self._valid = whole.valid
        self._newest = replace(whole, is_due=is_due, reports=reports, **changes)
        return self._newest
