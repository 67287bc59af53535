"""Drives that a board sends one by one, checked, and the frames that full turns of them make."""

from __future__ import annotations

import numpy as np

from tomoskin.board.source.command_queue import SequenceFilter
from tomoskin.core import DriveSamples, Event, Frame

_MODULUS = 2**32

Received = Frame | DriveSamples | Event
"""What comes from a board: scans, drives of them where these are sent one by one, and events."""


class Assembler:
    """Passes drives on at once, and behind the last of a full turn its frame.

    A drive that is late, doubled, or of another scan is left out and counted, as a frame is. A turn
    that lacks a drive makes no frame and is counted as lost.

    ``broken`` is how many full turns in a row have lacked a drive; ``unsaid`` whether drives are
    asked for, none has come yet, and nobody has been told so.
    """

    def __init__(self, frames: SequenceFilter, n_drives: int, *, asked: bool = True) -> None:
        """``frames`` is the filter that drives and frames go through."""
        self._frames, self._n_drives = frames, n_drives
        self.unsaid = asked
        self.forget()

    def say_whole(self, now: float) -> list[Received]:
        """Scans come whole though drives were asked for: an event says so once."""
        unsaid, self.unsaid = self.unsaid, False
        text = "the board sends whole scans only: a touch shows at the end of its first scan"
        return [Event(now, "whole-scans", text)] if unsaid else []

    def forget(self) -> None:
        """What comes next does not follow what came before."""
        self.broken = 0
        self._last: DriveSamples | None = None
        self._turn: list[DriveSamples] | None = None
        """The drives of a full turn that lacks none so far."""

    def take(self, drive: DriveSamples) -> list[Received]:
        """The drive and the frame that it completes, or nothing; and an event if some is wrong."""
        events = self._frames.refuse(drive)
        if events is not None:
            return [*events]
        last, counters = self._last, self._frames.counters
        ahead = (drive.sequence - last.sequence) % _MODULUS if last else 1
        if last and ahead == 0 and _head(drive) != _head(last):
            counters.foreign += 1
            self._turn = None
            return []
        if last and (ahead >= _MODULUS // 2 or (ahead == 0 and drive.place <= last.place)):
            counters.stale += 1
            return []
        self._last = drive
        items: list[Received] = []
        if last is None or ahead:
            items += self._begin(drive, last)
        elif drive.place > last.place + 1:
            self._turn = None
        return items + self._complete(drive)

    def _begin(self, drive: DriveSamples, last: DriveSamples | None) -> list[Event]:
        """A turn begins after that of ``last``, with its first drive or a later one."""
        whole = self._turn is not None and len(self._turn) == self._n_drives
        if last and not whole:
            self.broken += 1
        self._turn = None if drive.place else []
        return self._frames.reach(drive)

    def _complete(self, drive: DriveSamples) -> list[Received]:
        """The drive, and the frame if it is the last one of a turn that lacks none."""
        if self._turn is None:
            return [drive]
        self._turn.append(drive)
        if drive.place < self._n_drives - 1:
            return [drive]
        self.broken = 0
        return [drive, *self._frames.take(_frame(self._turn))]


def _head(drive: DriveSamples) -> tuple[int, int]:
    """What all drives of a turn have in common."""
    return drive.flags, drive.drops


def _frame(turn: list[DriveSamples]) -> Frame:
    """The frame of a full turn: that which a board sends whole."""
    first, sums = turn[0], [drive.sums for drive in turn if drive.sums is not None]
    return Frame(
        sequence=first.sequence,
        ticks=first.ticks,
        host_time=turn[-1].host_time,
        configuration=first.configuration,
        flags=first.flags,
        drops=first.drops,
        samples=np.concatenate([drive.samples for drive in turn]),
        sums=np.concatenate(sums) if sums else None,
    )
