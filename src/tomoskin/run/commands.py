"""Messages in: everything that a run may be asked, of the twin too, and the queue to its thread."""

from __future__ import annotations

import math
import threading
from collections import deque
from collections.abc import Callable
from concurrent.futures import Future
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Annotated, Literal

import msgspec
import numpy as np
from msgspec import Meta

from tomoskin.board.source import Transport
from tomoskin.core import WireError
from tomoskin.files.session import MessageLog
from tomoskin.pipeline import Prepared
from tomoskin.twin import FACES, Face, Grid, Press, Probe, Shape

MAX_PRESSES = 8
"""Most presses that one page may hold."""

MAX_FORCE = 10.0
"""Hardest press from a page, N."""

_NODES, _MARGIN, _LEAST = 64, 0.06, 4
"""A polygon must cover some nodes of a grid as coarse as the one that its dent is solved on."""

_Place = Annotated[float, Meta(ge=-10, le=10)]
_Turn = Annotated[float, Meta(ge=-2 * math.pi, le=2 * math.pi)]
_Corner = Annotated[float, Meta(ge=-1, le=1)]


class StrictRequest(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """What a page may send; a field that is not known is an error."""


class PressRequest(StrictRequest, frozen=True):
    """One press: place m, force N, ``radius`` half of the face's size m, turned by ``angle`` rad.

    ``vertices``: corners (x, y) m of a polygon around the probe's middle.
    """

    x: _Place
    y: _Place
    force: Annotated[float, Meta(ge=0, le=MAX_FORCE)]
    radius: Annotated[float, Meta(ge=1e-4, le=1)]
    shape: Literal["circle", "square", "finger", "polygon"] = "circle"
    angle: _Turn = 0.0
    vertices: Annotated[tuple[tuple[_Corner, _Corner], ...], Meta(max_length=24)] | None = None

    @property
    def contact(self) -> Probe:
        """What presses on the twin.

        Raises WireError where corners are missing, GeometryError where they make no polygon.
        """
        if (self.shape == "polygon") != (self.vertices is not None):
            raise WireError(
                f"expected vertices for a polygon and for no other shape, got {self.shape}"
            )
        if self.vertices is not None:
            face: Shape = _wide(Face(self.vertices))
            return Probe(face, self.x, self.y, self.force, self.angle)
        if self.shape == "circle":
            return Press(self.x, self.y, self.force, self.radius)
        face = FACES[self.shape](self.radius)
        return Probe(face, self.x, self.y, self.force, self.angle)


def _wide(face: Face) -> Face:
    """``face``; WireError where it is too slim to be pressed."""
    step = 2 * (face.extent + _MARGIN) / _NODES
    if np.count_nonzero(np.isfinite(face.gap(Grid(2 * _NODES, step).points))) < _LEAST:
        raise WireError(f"expected a polygon at least {2e3 * step:.0f} mm wide, got a narrower one")
    return face


class SetPresses(StrictRequest, frozen=True, tag="presses"):
    """All presses that this page holds now."""

    presses: Annotated[tuple[PressRequest, ...], Meta(max_length=MAX_PRESSES)]


class SetTwin(StrictRequest, frozen=True, tag="twin"):
    """All that is wrong with the twin from now on: electrodes cut, LSB of noise (null: its own)."""

    cut: Annotated[tuple[Annotated[int, Meta(ge=0, le=31)], ...], Meta(max_length=32)]
    noise: Annotated[float, Meta(ge=0, le=1000)] | None


class BendRequest(StrictRequest, frozen=True):
    """By ``angle`` rad from rest, positive where the front becomes convex; for a sheet that lies
    flat, over a strip of ``length`` m along ``axis`` (rad from x), ``offset`` m off the middle."""

    angle: _Turn
    axis: _Turn = math.pi / 2
    length: Annotated[float, Meta(ge=1e-3, le=10)] = 0.06
    offset: _Place = 0.0


class StretchRequest(StrictRequest, frozen=True):
    """Relative elongations along ``axis`` (rad from x) and across it."""

    along: Annotated[float, Meta(ge=-0.5, le=1)]
    across: Annotated[float, Meta(ge=-0.5, le=1)] = 0.0
    axis: _Turn = 0.0


class SetPose(StrictRequest, frozen=True, tag="pose"):
    """How the twin's sheet is bent and stretched from now on; null: as at rest."""

    bend: BendRequest | None = None
    stretch: StretchRequest | None = None


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
    frames: int | None = None
    """The most that are recorded."""


@dataclass(frozen=True, slots=True)
class StopRecording:
    """End the recording, if there is one; done when the file is complete."""


@dataclass(frozen=True, slots=True)
class HoldPresses:
    """All presses on the twin that ``owner`` holds now; an empty tuple lifts them."""

    owner: object
    presses: tuple[Probe, ...]


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
