"""What a session holds: its references, and a summary."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any

from tomoskin.board.source import ClockFit, ClockFitter
from tomoskin.core import Mark, MarkedFrame, StrPath
from tomoskin.files.session.scanned import Advance, first_scan, no_report, scanned_touches
from tomoskin.files.session.session_reader import (
    SessionReader,
    indexed_frames,
    message_counts,
    reference_frames,
)
from tomoskin.files.session.session_writer import OLD_INDEX_FILE, SKIN_FILE
from tomoskin.sensing.track import Span, touch_spans

_KEPT = 3
"""So many times those are played: the operator follows the reference's noise during the rest."""


class References:
    """Finds them in a file of its own; what was gone through once is remembered.

    Parameters
    ----------
    path
        The session.
    settings
        Its last settings.
    """

    def __init__(self, path: Path, settings: Mapping[str, Any]) -> None:
        self._count = _KEPT * reference_frames(settings)
        self._path = path
        self._begun: list[float] = []
        self._searched = float("-inf")

    def before(self, host_time: float) -> tuple[MarkedFrame, ...]:
        """Frames of the last reference that was begun before ``host_time``, marked as earlier.

        Raises
        ------
        DataError
            When the file is damaged before that time.
        """
        with SessionReader(self._path) as session:
            self._search(session, host_time)
            since = max((time for time in self._begun if time < host_time), default=None)
            if since is None:
                return ()
            frames: list[MarkedFrame] = []
            for item in session.frames(since):
                if item.frame.host_time >= host_time or len(frames) == self._count:
                    break
                if frames and item.mark & Mark.REFERENCE:
                    break
                if not item.mark & (Mark.HELD | Mark.SKIPPED):
                    frames.append(MarkedFrame(item.frame, item.mark | Mark.EARLIER))
        return tuple(frames)

    def _search(self, session: SessionReader, host_time: float) -> None:
        if host_time <= self._searched:
            return
        since = None if self._searched == float("-inf") else self._searched
        for item in session.frames(since):
            if item.frame.host_time >= host_time:
                break
            if item.mark & Mark.REFERENCE and item.frame.host_time not in self._begun[-1:]:
                self._begun.append(item.frame.host_time)
            self._searched = item.frame.host_time


OWN_FILES = frozenset({SKIN_FILE, OLD_INDEX_FILE})
"""What a session attaches of itself."""

_OFTEN = 1000
_MODULUS = 2**32


@dataclass(frozen=True)
class SessionInfo:
    """A session at a glance.

    ``frames`` and those of them that were ``held`` or ``skipped``; ``lost`` frames missing in the
    sequence, in ``gaps`` places; ``dropped`` by the device itself; ``rate`` frames/s, NaN below
    two; ``longest_pause`` s between two frames; ``touches`` number of those that were recorded,
    and ``spans`` these, in s from the first frame; ``presses`` on the twin, each once;
    ``attached`` names of the files inside beside the skin, as calibrations that were on; ``torn``
    what is missing at the end, or "".
    """

    path: str
    size: int
    torn: str
    begun: float | None
    duration: float
    skin: str
    skin_identity: str
    electrodes: int
    rows: int
    frames: int
    rate: float
    longest_pause: float
    held: int
    skipped: int
    lost: int
    gaps: int
    dropped: int
    touches: int
    presses: int
    events: dict[str, int]
    notes: int
    device: dict[str, Any]
    clock: ClockFit | None
    messages: dict[str, int]
    attached: tuple[str, ...] = ()
    spans: tuple[Span, ...] = ()


@dataclass
class _Frames:
    """Counts frames; what has no underscore is told of the session by the same name."""

    frames: int = 0
    held: int = 0
    skipped: int = 0
    lost: int = 0
    gaps: int = 0
    dropped: int = 0
    longest_pause: float = 0.0
    _first: float = 0.0
    _last: float = 0.0
    _sequence: int = 0
    _drops: int = 0

    def add(self, item: MarkedFrame) -> None:
        """Take the next frame; those from before the recording do not count."""
        frame, mark = item.frame, item.mark
        if mark & Mark.EARLIER:
            return
        self.held += bool(mark & Mark.HELD)
        self.skipped += bool(mark & Mark.SKIPPED)
        missing = (frame.sequence - self._sequence - 1) % _MODULUS
        if self.frames and not mark & Mark.OPENED and 0 < missing < _MODULUS // 2:
            self.lost, self.gaps = self.lost + missing, self.gaps + 1
        if self.frames:
            self.longest_pause = max(self.longest_pause, frame.host_time - self._last)
        else:
            self._first = frame.host_time
        begun_anew = frame.drops < self._drops
        self.dropped += frame.drops if begun_anew else frame.drops - self._drops
        self._sequence, self._drops, self._last = frame.sequence, frame.drops, frame.host_time
        self.frames += 1

    def summary(self, epoch: float) -> dict[str, Any]:
        """The counts by name, with when the frames began, how long they took, and their rate."""
        span = self._last - self._first
        return {name: value for name, value in vars(self).items() if name[0] != "_"} | {
            "begun": epoch + self._first if epoch else None,
            "duration": span,
            "rate": (self.frames - 1) / span if span > 0 else float("nan"),
        }


def _begun(counts: Sequence[int]) -> int:
    """How many began, of those that there are at one time after the other."""
    return sum(max(0, now - before) for before, now in pairwise([0, *counts]))


def session_info(path: StrPath, advance: Advance = no_report) -> SessionInfo:
    """Read a whole session and say what is in it.

    Raises
    ------
    DataError
        When the file cannot be read, is no session, or is damaged.
    """
    path = Path(path)
    size = path.stat().st_size if path.is_file() else 0
    frames, clock = _Frames(), ClockFitter()
    with SessionReader(path) as session:
        total = indexed_frames(session)
        for number, item in enumerate(session.frames()):
            frames.add(item)
            clock.add(item.frame.ticks, item.frame.host_time)
            if number % _OFTEN == 0:
                advance(number, max(total, number + 1))
        begun = first_scan(session)
        touched = ((time - begun, touches) for _, time, touches in scanned_touches(session))
        spans = touch_spans(touched)
        messages = message_counts(session)
        return SessionInfo(
            path=str(path),
            size=size,
            torn=session.torn,
            skin=session.skin.name,
            skin_identity=session.skin.identity,
            electrodes=session.skin.n_electrodes,
            rows=session.skin.pattern().n_meas,
            **frames.summary(session.epoch),
            touches=len(spans),
            presses=_begun([len(item.presses) for item in session.truth()]),
            events=dict(Counter(event.kind for event in session.events())),
            notes=sum(1 for _ in session.notes()),
            device=session.device(),
            clock=clock.fit,
            messages=messages,
            spans=spans,
            attached=tuple(name for name in session.attachments() if name not in OWN_FILES),
        )
