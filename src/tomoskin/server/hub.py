"""Between the run's thread and the pages: each message made once, each page woken once."""

from __future__ import annotations

import asyncio
import contextlib
from collections import deque
from collections.abc import AsyncIterator, Callable, Sequence
from pathlib import Path

from tomoskin.board.source import Transport
from tomoskin.core import DataError, WireError
from tomoskin.files.session import read_timeline
from tomoskin.model.skin import Skin
from tomoskin.pipeline import Prepared, colour_limit
from tomoskin.run import Runner, commands
from tomoskin.server import page_messages
from tomoskin.server.frames import NewestFrame
from tomoskin.server.requests import Request
from tomoskin.server.run_handlers import run_handlers
from tomoskin.server.task import Handler, Handlers, Listener, Tasks, beside

MAX_PAGES = 16
"""Pages that are served at once."""

_STATE_PERIOD = 0.25
_FIRST_EVENTS = 20
"""Events of the past that a new page is sent."""


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
    frame
        The newest result as a page takes it.
    tasks
        What pages have asked for and is under way.
    """

    def __init__(self, runner: Runner, *, limit: float, folder: Path | None = None) -> None:
        self.runner = runner
        self.folder = folder or Path()
        self.opener: Callable[[Skin], Transport] | None = None
        self.frame, self.tasks = NewestFrame(runner), Tasks()
        self._handlers: dict[type, Handler] = {}
        self._greetings: list[Callable[[], Sequence[str]]] = []
        self._pages: set[Listener] = set()
        self._wake_is_due = False
        self._next_event = 0
        self._timeline = ""
        self._past: deque[str] = deque(maxlen=_FIRST_EVENTS)
        self._limit, self._scene = limit, ""
        self.serve(run_handlers(runner, self.folder, self.tasks))

    def serve(
        self, handlers: Handlers, greeting: Callable[[], Sequence[str]] | None = None
    ) -> None:
        """Answer these requests too, before the first page comes; ``greeting``: messages for a
        new page, and for all where the runner has another skin or source."""
        self._handlers.update(handlers)
        if greeting is not None:
            self._greetings.append(greeting)

    @contextlib.asynccontextmanager
    async def running(self) -> AsyncIterator[None]:
        """Listen to the runner while the block lasts."""
        loop = asyncio.get_running_loop()

        def announce() -> None:
            if not self._wake_is_due:
                self._wake_is_due = True
                loop.call_soon_threadsafe(self._wake)

        async with beside(self._tick()):
            self._read_timeline()
            with self.runner.audience.watch(announce):
                yield

    def join(self, page: Listener) -> bool:
        """Serve ``page`` from now on; False where there are too many."""
        if len(self._pages) >= MAX_PAGES:
            return False
        self._pages.add(page)
        timeline = [self._timeline] if self._timeline else []
        now = page_messages.state(self.runner.status())
        for text in (self._scene_text(), now, *timeline, *self._greeting(), *self._past):
            page.post(text)
        return True

    def leave(self, page: Listener, why: str = "") -> None:
        """Serve ``page`` no longer, and lift what it pressed."""
        self._pages.discard(page)
        self.runner.submit(commands.HoldPresses(page, ()))
        self.runner.latency.forget(page)
        if why:
            self.runner.say("page-dropped", why)

    def obey(self, page: Listener, request: Request) -> None:
        """Do what a page asks. Raises WireError where that cannot be."""
        handler = self._handlers.get(type(request))
        if handler is None:
            raise WireError(f"{type(request).__name__} is not possible on this page")
        handler(page, request)

    def tell(self, texts: Sequence[str]) -> None:
        """Send ``texts`` to every page."""
        for page in self._pages:
            for text in texts:
                page.post(text)

    def show(self) -> None:
        """Tell every page that the runner has another skin or source."""
        self._limit, self._scene = colour_limit(self.runner.prepared), ""
        self._timeline = ""
        now = page_messages.state(self.runner.status())
        self.tell([self._scene_text(), now, *self._greeting()])
        self._read_timeline()

    def rescale(self, prepared: Prepared, limit: float) -> None:
        """Tell every page that pictures have another scale and unit from now on."""
        self._limit, self._scene = limit, ""
        self.tell([page_messages.scale(prepared, limit)])

    def _greeting(self) -> list[str]:
        return [text for greeting in self._greetings for text in greeting()]

    def _scene_text(self) -> str:
        """The scene, made when the first page asks for it."""
        if not self._scene:
            runner = self.runner
            source, pressable = runner.status().source, runner.twin.pressable
            self._scene = page_messages.scene(
                runner.prepared, source, limit=self._limit, pressable=pressable
            )
        return self._scene

    def _read_timeline(self) -> None:
        """Of a replay: tell every page what happened in the recording, once that has been read."""
        if (replay := self.runner.replay) is not None:
            self.tasks.keep(self._tell_timeline(replay.path))

    async def _tell_timeline(self, path: Path) -> None:
        try:
            timeline = await asyncio.to_thread(read_timeline, path)
        except DataError as error:
            self.runner.say("no-timeline", f"the events of the recording cannot be shown: {error}")
            return
        self._timeline = page_messages.timeline(timeline)
        self.tell([self._timeline])

    def _wake(self) -> None:
        self._wake_is_due = False
        for page in self._pages:
            page.wake()

    async def _tick(self) -> None:
        while True:
            self._next_event, happened = self.runner.events.since(self._next_event)
            news = [page_messages.event(event) for event in happened]
            self._past.extend(news)
            self.tell([*news, page_messages.state(self.runner.status())])
            await asyncio.sleep(_STATE_PERIOD)
