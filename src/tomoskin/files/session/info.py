"""What a session holds: its references, and a summary."""

from __future__ import annotations

from array import array
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from tomoskin.board.source import ClockFit, ClockFitter
from tomoskin.core import FloatArray, Mark, MarkedFrame, StrPath
from tomoskin.files.messages import DeformationSpan, deformation_spans
from tomoskin.files.session.scanned import (
    Advance,
    first_scan,
    no_report,
    scanned_deformations,
    scanned_touches,
)
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
    ``spans`` these and ``deformations`` those of the sheet, in s from the first frame; ``presses``
    on the twin, each once; ``attached`` names of the files inside beside the skin, as calibrations
    that were on; ``torn`` what is missing at the end, or "".
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
    deformations: tuple[DeformationSpan, ...] = ()


def _summary(table: FloatArray, epoch: float) -> dict[str, Any]:
    """What a session says of its own frames by name; a row of the ``table`` is a frame's host time,
    sequence, drops and mark."""
    times, sequence, drops = table[:, :3].T
    marks = table[:, 3].astype(int)
    missing = (np.diff(sequence) - 1) % _MODULUS
    missing[(missing >= _MODULUS // 2) | (marks[1:] & Mark.OPENED > 0)] = 0
    more = np.diff(drops, prepend=0.0)  # less than before where the board has begun again
    first, span = (times[0], times[-1] - times[0]) if len(times) else (0.0, 0.0)
    return {
        "frames": len(times),
        "held": int(np.count_nonzero(marks & Mark.HELD)),
        "skipped": int(np.count_nonzero(marks & Mark.SKIPPED)),
        "lost": int(missing.sum()),
        "gaps": int(np.count_nonzero(missing)),
        "dropped": int(np.where(more < 0, drops, more).sum()),
        "longest_pause": float(np.max(np.diff(times), initial=0.0)),
        "begun": epoch + float(first) if epoch else None,
        "duration": float(span),
        "rate": float((len(times) - 1) / span) if span > 0 else float("nan"),
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
    table, clock = array("d"), ClockFitter()
    with SessionReader(path) as session:
        total = indexed_frames(session)
        for number, item in enumerate(session.frames()):
            frame = item.frame
            clock.add(frame.ticks, frame.host_time)
            if not item.mark & Mark.EARLIER:
                table.extend((frame.host_time, frame.sequence, frame.drops, item.mark))
            if number % _OFTEN == 0:
                advance(number, max(total, number + 1))
        begun = first_scan(session)
        touched = ((time - begun, touches) for _, time, touches in scanned_touches(session))
        spans = touch_spans(touched)
        deformed = [(time - begun, bent) for _, time, bent in scanned_deformations(session)]
        messages = message_counts(session)
        return SessionInfo(
            path=str(path),
            size=size,
            torn=session.torn,
            skin=session.skin.name,
            skin_identity=session.skin.identity,
            electrodes=session.skin.n_electrodes,
            rows=session.skin.pattern().n_meas,
            **_summary(np.array(table).reshape(-1, 4), session.epoch),
            touches=len(spans),
            presses=_begun([len(item.presses) for item in session.truth()]),
            events=dict(Counter(event.kind for event in session.events())),
            notes=sum(1 for _ in session.notes()),
            device=session.device(),
            clock=clock.fit,
            messages=messages,
            spans=spans,
            deformations=deformation_spans(deformed),
            attached=tuple(name for name in session.attachments() if name not in OWN_FILES),
        )
