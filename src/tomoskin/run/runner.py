"""The running pipeline: a thread that owns the source and keeps only the newest result."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager
from pathlib import Path

from tomoskin.pipeline import Prepared
from tomoskin.run.events import EventLog
from tomoskin.run.flow import Snapshot
from tomoskin.run.latency import Latency
from tomoskin.run.loop import Loop
from tomoskin.run.posing import Posed
from tomoskin.run.presses import Harm
from tomoskin.run.publisher import Audience
from tomoskin.run.status import Status
from tomoskin.run.wanted import Opener, Wanted
from tomoskin.run.wishes import Replayed
from tomoskin.signal import Reference
from tomoskin.sink import Sink
from tomoskin.twin import Contact
from tomoskin.wire import Info


class Runner:
    """Feeds a pipeline from a source until it is stopped; may be asked from any thread.

    A source that is lost is opened again, after a pause that doubles up to 5 s; the reference
    stands meanwhile. Readers take :attr:`newest` whenever they like; a slow one delays nobody.

    Parameters
    ----------
    prepared
        What was made once for the skin.
    open_transport
        Opens the source; called again after a loss.
    clock
        Host monotonic seconds, the same as in ``Frame.host_time``.
    sinks
        Where results go, beside those who take :attr:`newest`; a slow one delays nobody.
    """

    def __init__(
        self,
        prepared: Prepared,
        open_transport: Opener,
        *,
        clock: Callable[[], float] = time.monotonic,
        sinks: Sequence[Sink] = (),
    ) -> None:
        self._audience = Audience(clock, tuple(sinks))
        self._wanted = Wanted()
        self._loop = Loop(prepared, open_transport, self._wanted, self._audience)
        self._thread: threading.Thread | None = None

    def start(self) -> None:
        """Open the source and begin.

        Raises
        ------
        SourceError
            When the source cannot be opened the first time: better said at once than retried.
        """
        transport = self._loop.open()
        self._loop.flow.opened(transport)
        self._thread = threading.Thread(
            target=self._loop.run, args=(transport,), name="tomoskin-runner", daemon=True
        )
        self._thread.start()

    def stop(self) -> None:
        """Stop the device and end; returns when it is done. A second call does nothing."""
        self._wanted.stop()
        if self._thread is not None:
            self._thread.join()
        self._loop.flow.out.stop()

    @property
    def alive(self) -> bool:
        """Whether its thread runs."""
        return self._thread is not None and self._thread.is_alive()

    def change(self, prepared: Prepared, open_transport: Opener) -> None:
        """Go on with another skin or source; returns when it does, from any thread but its own.

        A recording ends, and the reference is taken anew. The old source is closed before the
        new one is opened, since both may be the same port.

        Raises
        ------
        SourceError
            When the new one cannot be opened (or any error of its kind): the old one goes on.
        """
        self._wanted.change(prepared, open_transport, lambda: self.alive)

    def adopt(self, prepared: Prepared) -> None:
        """Go on with other settings of the same mesh and scan, from the next read on.

        The reference stands; a recording ends. Nothing is done where the skin has been changed
        meanwhile (:meth:`change`). Returns when it is done, or a second later where no source
        is there to go on with; from any thread but its own.
        """
        self._wanted.adopt(prepared)

    # What it is.

    @property
    def prepared(self) -> Prepared:
        """The skin of the moment."""
        return self._loop.flow.prepared

    @property
    def newest(self) -> Snapshot | None:
        """The newest result, or None before the first."""
        return self._loop.flow.newest

    @property
    def events(self) -> EventLog:
        """What happened, the newest kept."""
        return self._audience.events

    @property
    def source(self) -> str:
        """Source and skin in words, once it has been opened."""
        return self._loop.flow.source

    @property
    def opening(self) -> Opener:
        """What opens the source."""
        return self._loop.open

    @property
    def board(self) -> Info | None:
        """What the board said of itself, once it has."""
        return self._loop.flow.out.tape.info

    @property
    def reference(self) -> Reference | None:
        """What the untouched skin reads; None until that is known."""
        return self._loop.flow.pipeline.reference

    @property
    def replay(self) -> Replayed | None:
        """The recording that is being played; None where the source is another."""
        return self._loop.flow.wishes.replay

    @property
    def latency(self) -> Latency:
        """How long each stage takes; who publishes and paints says so here."""
        return self._loop.flow.latency

    def status(self) -> Status:
        """How it is doing now."""
        return self._loop.flow.status(self._loop.trouble)

    def watched_by(self, announce: Callable[[], None]) -> AbstractContextManager[None]:
        """While the block lasts, call ``announce`` from the runner's thread at each result.

        It must return at once. After the block it is not called again.
        """
        return self._audience.watchers.with_one(announce)

    # What a person does with it.

    def take_reference(self) -> None:
        """The next frames become the reference."""
        self._loop.flow.wishes.take_reference()

    def pause(self, on: bool) -> None:
        """Hold the picture, or let it go on; frames are read and left out meanwhile."""
        self._loop.flow.wishes.hold(on)

    def record(self, path: Path) -> None:
        """Record from now on, beside the pipeline: raw bytes, frames, touches and the rest.

        Raises
        ------
        DataError
            When the file exists or cannot be made. What goes wrong later is an event.
        """
        self._loop.flow.out.tape.record(path)

    def stop_recording(self) -> None:
        """End the recording, if there is one; returns when the file is whole."""
        self._loop.flow.out.tape.stop()

    def note(self, text: str) -> None:
        """A person's remark on the picture of this moment; goes into the recording as well."""
        self._loop.flow.note(text)

    def say(self, kind: str, text: str) -> None:
        """Publish an event of this moment."""
        self._loop.flow.out.say(kind, text)

    # What a person does to the twin.

    @property
    def pressable(self) -> bool:
        """Whether the source can be pressed from a page, as the twin can."""
        return self._loop.flow.pressable

    def set_presses(self, owner: object, presses: tuple[Contact, ...]) -> None:
        """All presses that ``owner`` holds now; an empty tuple lifts them."""
        self._loop.flow.hands.board.put(owner, presses)

    @property
    def breakable(self) -> bool:
        """Whether the source can be broken and mended, as the twin can."""
        return self._loop.flow.hands.breakable

    @property
    def harmed(self) -> Harm:
        """What is wrong with the source by our doing."""
        return self._loop.flow.hands.harmed

    def harm(self, harm: Harm) -> None:
        """Break and mend the source; ModelError for what it does not have."""
        self._loop.flow.hands.harm(harm)

    @property
    def bendable(self) -> bool:
        """Whether the source has a sheet that can be bent and stretched."""
        return self._loop.flow.hands.bendable

    @property
    def posed(self) -> Posed:
        """How the source's sheet is bent and stretched by our doing."""
        return self._loop.flow.hands.posed

    def bend(self, posed: Posed) -> None:
        """Bend and stretch the source; GeometryError for a shape that it cannot take."""
        self._loop.flow.hands.bend(posed)
