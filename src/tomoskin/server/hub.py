"""Between the runner's thread and the pages: each message made once, each page woken once."""

from __future__ import annotations

import asyncio
import contextlib
import time
from collections import deque
from collections.abc import AsyncIterator, Callable, Coroutine, Mapping, Sequence
from pathlib import Path
from typing import Any, Protocol

import numpy as np

from tomoskin.core import DataError, GeometryError, TomoskinError, WireError
from tomoskin.pipeline import Prepared, colour_limit
from tomoskin.recording import read_timeline
from tomoskin.run import Runner, SetPresses, Snapshot
from tomoskin.server import messages
from tomoskin.server.frames import encode_result
from tomoskin.server.play import play
from tomoskin.server.requests import (
    Note,
    Painted,
    ReplayRequest,
    Request,
    SetPause,
    SetRecording,
    TakeReference,
)
from tomoskin.skin import Skin
from tomoskin.source import Transport
from tomoskin.twin import Contact

MAX_PAGES = 16
"""Pages that are served at once."""

_STATE_PERIOD = 0.25
_FILE_NAME = "tomoskin-%Y%m%d-%H%M%S.mcap"
_FIRST_EVENTS = 20
"""Events of the past that a new page is told."""


class Listener(Protocol):
    """What the hub needs of a page's connection."""

    def wake(self) -> None:
        """Say that there is a new frame."""

    def post(self, text: str) -> None:
        """Send ``text`` soon."""


class Desk(Protocol):
    """What answers some of the requests, beside the hub itself."""

    @property
    def handlers(self) -> Mapping[type, Callable[[Listener, Any], None]]:
        """What to call with a page and its request, by the request's type; WireError refuses."""

    def greeting(self) -> Sequence[str]:
        """Messages that a new page is told."""


class Hub:
    """The pages of one runner; lives in the event loop.

    Parameters
    ----------
    runner
        Where results come from.
    limit
        End of the colour scale, in the image's unit.
    folder
        Where a page's recordings go, under names of their own.

    Attributes
    ----------
    opener
        Opens the source of the moment for a skin; None: it cannot follow another skin.
    """

    def __init__(self, runner: Runner, *, limit: float, folder: Path | None = None) -> None:
        self.runner = runner
        self.folder = folder or Path()
        self.opener: Callable[[Skin], Transport] | None = None
        self._pages: set[Listener] = set()
        self._wake_is_due = False
        self._encoded: tuple[Snapshot, bytes] | None = None
        self._told = 0
        self._timeline = ""
        self._tasks: set[asyncio.Task[None]] = set()
        self._desks: list[Desk] = []
        self._past: deque[str] = deque(maxlen=_FIRST_EVENTS)
        self._limit, self._scene = limit, ""

    @contextlib.asynccontextmanager
    async def running(self) -> AsyncIterator[None]:
        """Listen to the runner while the block lasts."""
        loop = asyncio.get_running_loop()

        def announce() -> None:
            if not self._wake_is_due:
                self._wake_is_due = True
                loop.call_soon_threadsafe(self._wake)

        ticker = asyncio.create_task(self._tick())
        if self.runner.replay is not None:
            self.keep(self._tell_timeline(self.runner.replay.path))
        with self.runner.watched_by(announce):
            yield
        ticker.cancel()
        with contextlib.suppress(asyncio.CancelledError):
            await ticker

    @property
    def full(self) -> bool:
        """Whether no further page can be served."""
        return len(self._pages) >= MAX_PAGES

    def join(self, page: Listener) -> None:
        """Serve ``page`` from now on."""
        self._pages.add(page)
        timeline = [self._timeline] if self._timeline else []
        greetings = [text for desk in self._desks for text in desk.greeting()]
        now = messages.state(self.runner.status())
        for text in (self._seen(), now, *timeline, *greetings, *self._past):
            page.post(text)

    def show(self) -> None:
        """Tell every page that the runner has another skin or source."""
        self._limit, self._scene = colour_limit(self.runner.prepared), ""
        self._encoded, self._timeline = None, ""
        greetings = [text for desk in self._desks for text in desk.greeting()]
        self.tell([self._seen(), messages.state(self.runner.status()), *greetings])
        if self.runner.replay is not None:
            self.keep(self._tell_timeline(self.runner.replay.path))

    def rescale(self, prepared: Prepared, limit: float) -> None:
        """Tell every page that pictures have another scale and unit from now on."""
        self._limit, self._scene = limit, ""
        self.tell([messages.scale(prepared, limit)])

    def _seen(self) -> str:
        """The scene, made when the first page asks for it."""
        if not self._scene:
            now = self.runner
            self._scene = messages.scene(
                now.prepared, now.source, limit=self._limit, pressable=now.pressable
            )
        return self._scene

    def leave(self, page: Listener, why: str = "") -> None:
        """Serve ``page`` no longer, and lift what it pressed."""
        self._pages.discard(page)
        self.runner.set_presses(page, ())
        self.runner.latency.gone(page)
        if why:
            self.runner.say("page-dropped", why)

    def frame(self) -> bytes | None:
        """The newest binary message; None before the first frame."""
        newest = self.runner.newest
        if newest is None:
            return None
        if self._encoded is None or self._encoded[0] is not newest:
            data = encode_result(newest.result, newest.truth, newest.latency)
            self._encoded = (newest, data)
        return self._encoded[1]

    def sent(self, frame: bytes) -> None:
        """A page's connection has taken this message."""
        if self._encoded is not None and self._encoded[1] is frame:
            took = time.monotonic() - self._encoded[0].ready
            self.runner.latency.took("publish", took)

    def take(self, desk: Desk) -> None:
        """Let ``desk`` answer requests of its types, before the first page comes."""
        self._desks.append(desk)

    def obey(self, page: Listener, request: Request) -> None:
        """Do what a page asks."""
        for desk in self._desks:
            if type(request) in desk.handlers:
                desk.handlers[type(request)](page, request)
                return
        if isinstance(request, SetPresses):
            self.runner.set_presses(page, self._on_skin(request))
        elif isinstance(request, SetPause):
            self.runner.pause(request.on)
        elif isinstance(request, SetRecording):
            asyncio.get_running_loop().run_in_executor(None, self._record, request.on)
        elif isinstance(request, TakeReference):
            self.runner.take_reference()
        elif isinstance(request, Note):
            self.runner.note(request.text)
        elif isinstance(request, Painted):
            self.runner.latency.painted(page, request.p50_s, request.p99_s)
        elif isinstance(request, ReplayRequest):
            self._play(page, request)
        else:
            raise WireError(f"{type(request).__name__} is not answered here")

    def _play(self, page: Listener, request: ReplayRequest) -> None:
        """Do something to a replay; in a thread, since a jump may have to search the file.

        Raises WireError where the source is no replay.
        """
        replay = self.runner.replay
        if replay is None:
            raise WireError(f"{self.runner.source} is no replay")

        def run() -> str | None:
            try:
                play(replay, request)
            except TomoskinError as error:
                return messages.error(str(error))
            return None

        async def answer() -> None:
            if (text := await asyncio.to_thread(run)) is not None:
                page.post(text)

        self.keep(answer())

    def keep(self, work: Coroutine[None, None, None]) -> None:
        """Let ``work`` run until it is done; the loop itself would forget it."""
        task = asyncio.get_running_loop().create_task(work)
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)

    async def _tell_timeline(self, path: Path) -> None:
        try:
            found = await asyncio.to_thread(read_timeline, path)
        except DataError as error:
            self.runner.say("no-timeline", f"what happened in the recording is not known: {error}")
            return
        self._timeline = messages.timeline(found)
        self.tell([self._timeline])

    def _record(self, on: bool) -> None:
        """Begin or end a recording; in a thread, since a disk may take its time."""
        if not on:
            self.runner.stop_recording()
            return
        try:
            self.runner.record(self.folder / time.strftime(_FILE_NAME))
        except DataError as error:
            self.runner.say("recording-stopped", f"nothing is recorded: {error}")

    def _on_skin(self, request: SetPresses) -> tuple[Contact, ...]:
        """A finger that has slid off the sheet presses nothing; WireError for no face at all."""
        asked = request.presses
        if not asked:
            return ()
        outline = self.runner.prepared.skin.outline
        inside = outline.contains(np.array([(p.x, p.y) for p in asked]))
        try:
            return tuple(p.contact for p, on in zip(asked, inside, strict=True) if on)
        except GeometryError as error:
            raise WireError(str(error)) from None

    def _wake(self) -> None:
        self._wake_is_due = False
        for page in self._pages:
            page.wake()

    async def _tick(self) -> None:
        while True:
            self._told, happened = self.runner.events.since(self._told)
            news = [messages.event(e) for e in happened]
            self._past.extend(news)
            self.tell([*news, messages.state(self.runner.status())])
            await asyncio.sleep(_STATE_PERIOD)

    def tell(self, texts: Sequence[str]) -> None:
        """Send ``texts`` to every page."""
        for page in self._pages:
            for text in texts:
                page.post(text)
