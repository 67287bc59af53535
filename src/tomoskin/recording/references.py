"""Which frames the reference of a moment was made of: what a seek in a replay begins with."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from tomoskin.recording.layout import Mark, MarkedFrame
from tomoskin.recording.session_reader import SessionReader

_USUAL = 20
"""Frames that make a reference, where the session does not say."""

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
        count = settings.get("reference_frames")
        self._count = _KEPT * (count if isinstance(count, int) and count > 0 else _USUAL)
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
            found: list[MarkedFrame] = []
            for item in session.frames(since):
                if item.frame.host_time >= host_time or len(found) == self._count:
                    break
                if found and item.mark & Mark.REFERENCE:
                    break
                if not item.mark & (Mark.HELD | Mark.SKIPPED):
                    found.append(MarkedFrame(item.frame, item.mark | Mark.EARLIER))
        return tuple(found)

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
