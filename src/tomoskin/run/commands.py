"""Messages in: everything that a run may be asked, and the queue to its thread."""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Callable
from concurrent.futures import Future
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Annotated

from msgspec import Meta

from tomoskin.board.source import Transport
from tomoskin.files.session import MessageLog
from tomoskin.pipeline import Prepared
from tomoskin.run.twin_requests import SetPose, SetTwin, StrictRequest
from tomoskin.twin import Contact

MAX_NOTE = 500
"""Longest note, characters."""

Opener = Callable[[], Transport]
"""Opens a source; TomoskinError where it cannot be."""


# What a page may ask as well; pages send them as JSON.


class TakeReference(StrictRequest, frozen=True, tag="reference"):
    """The next frames become the reference."""


class SetPause(StrictRequest, frozen=True, tag="pause"):
    """Hold the picture, or let it go on; frames are read and left out meanwhile.

    A replay stands still instead.
    """

    on: bool


class Note(StrictRequest, frozen=True, tag="note"):
    """A remark on the picture of this moment; goes into the recording as well."""

    text: Annotated[str, Meta(min_length=1, max_length=MAX_NOTE)]


class Seek(StrictRequest, frozen=True, tag="seek"):
    """Play the recording from so many seconds after its first frame on."""

    at_s: Annotated[float, Meta(ge=0, le=1e9)]


class StepReplay(StrictRequest, frozen=True, tag="step"):
    """Play one read of the recording and stand still."""


class SetSpeed(StrictRequest, frozen=True, tag="speed"):
    """Recorded seconds per second; null for as fast as the pictures are made."""

    speed: Annotated[float, Meta(gt=0, le=1000)] | None


class SetLoop(StrictRequest, frozen=True, tag="loop"):
    """Begin the recording again at its end, or not."""

    on: bool


# What only programs ask.


@dataclass(frozen=True, slots=True)
class Record:
    """Record to a new file from now on: raw bytes, frames, touches and the rest.

    Done when the file has been made; DataError when it exists or cannot be made. What goes wrong
    later is an event.
    """

    path: Path
    log: MessageLog | None = None
    """Where the session goes, instead of a file of its own."""


@dataclass(frozen=True, slots=True)
class StopRecording:
    """End the recording, if there is one; done when the file is complete."""


@dataclass(frozen=True, slots=True)
class HoldPresses:
    """All presses on the twin that ``owner`` holds now; an empty tuple lifts them."""

    owner: object
    presses: tuple[Contact, ...]


@dataclass(frozen=True, slots=True, eq=False)
class Adopt:
    """Go on with other settings of the same mesh and scan.

    The reference stands; a recording ends, and it is done when its file is complete. Nothing
    happens where the skin has been changed meanwhile.
    """

    prepared: Prepared


@dataclass(frozen=True, slots=True, eq=False)
class Change:
    """Go on with another skin or source; None: the source of the moment, opened again.

    A recording ends, and the reference is taken again. The old source is closed before the new one
    is opened, since both may be the same port. SourceError (or any error of its kind) when it
    cannot be opened: the old one goes on.
    """

    prepared: Prepared
    open: Opener | None = None


ReplayCommand = Seek | StepReplay | SetSpeed | SetLoop
"""What only a replay can do; WireError where the source is another."""

DirectCommand = Note | SetPose | SetTwin | ReplayCommand
"""Carried out by the thread that asks: they belong to this very moment, or take long and are
made for any thread."""

QueuedCommand = TakeReference | SetPause | Record | StopRecording | HoldPresses | Adopt | Change
"""Carried out by the run's own thread between two reads, in the order in which they came."""

Command = DirectCommand | QueuedCommand

Handle = Callable[[QueuedCommand], "Future[None] | None"]
"""Carries a command out; what it returns is done when the command is, None: it is done already."""


class RunCommands:
    """Commands put by any thread and taken by one.

    While no thread takes them, whoever puts one carries it out.

    Attributes
    ----------
    taken
        Whether a thread takes them.
    """

    def __init__(self, handle: Handle) -> None:
        self._handle = handle
        self._waiting: deque[tuple[QueuedCommand, Future[None]]] = deque()
        self._lock = threading.RLock()
        self._nudge = threading.Event()
        self.taken = False

    def put(self, command: QueuedCommand) -> Future[None]:
        """Have ``command`` carried out soon."""
        future: Future[None] = Future()
        with self._lock:
            self._waiting.append((command, future))
            if not self.taken:
                self.carry_out()
        self._nudge.set()
        return future

    def begin(self) -> None:
        """A thread takes commands from here on."""
        with self._lock:
            self.taken = True

    def end(self) -> None:
        """It takes no more; those that wait are carried out now."""
        with self._lock:
            self.taken = False
            self.carry_out()

    def carry_out(self) -> None:
        """Carry out all commands that wait."""
        while self._waiting:
            command, future = self._waiting.popleft()
            if not future.set_running_or_notify_cancel():
                continue
            try:
                rest = self._handle(command)
            except Exception as error:  # it is the asking thread's
                future.set_exception(error)
                continue
            if rest is None:
                future.set_result(None)
            else:
                rest.add_done_callback(partial(_pass_on, future))

    def nudge(self) -> None:
        """Wake whoever waits in :meth:`wait`."""
        self._nudge.set()

    def wait(self, seconds: float) -> bool:
        """Wait that long; True as soon as there is a command, or a nudge."""
        came = self._nudge.wait(seconds)
        self._nudge.clear()
        return came


def _pass_on(future: Future[None], done: Future[None]) -> None:
    """The outcome of ``done`` is that of ``future``."""
    if (error := done.exception()) is not None:
        future.set_exception(error)
    else:
        future.set_result(None)
