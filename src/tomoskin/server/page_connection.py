"""One page's connection: reads its requests, and writes no faster than it reads."""

from __future__ import annotations

import asyncio
import contextlib
from abc import ABC, abstractmethod
from collections import deque
from collections.abc import AsyncIterator, Callable, Coroutine, Iterable, Mapping
from typing import Any, TypeVar

from starlette.websockets import WebSocket, WebSocketDisconnect

from tomoskin.core import TomoskinError, WireError
from tomoskin.run import StrictRequest
from tomoskin.server.page_messages import Message, Refusal
from tomoskin.server.requests import decode_request

_T = TypeVar("_T")


Handler = Callable[["Page", Any], None]
"""Does what a page asks; in the event loop, so it returns at once. WireError refuses."""

Handlers = Mapping[type, Handler]
"""Handlers by the type of the request."""


@contextlib.asynccontextmanager
async def during(work: Coroutine[None, None, None]) -> AsyncIterator[None]:
    """Do ``work`` while the block lasts, and no longer."""
    task = asyncio.create_task(work)
    try:
        yield
    finally:
        task.cancel()
        with contextlib.suppress(asyncio.CancelledError):
            await task


class Tasks:
    """Work that is under way, kept until it is done: the loop itself would forget it."""

    def __init__(self) -> None:
        """Make a set that holds no tasks yet."""
        self._tasks: set[asyncio.Task[None]] = set()

    def keep(self, work: Coroutine[None, None, None]) -> None:
        """Let ``work`` run until it is done."""
        task = asyncio.get_running_loop().create_task(work)
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)

    def run(self, page: Page, work: Callable[[], _T], then: Callable[[_T], None]) -> None:
        """Do ``work`` in a thread and ``then`` in the loop; what it raises goes to ``page``."""

        async def run() -> None:
            try:
                outcome = await asyncio.to_thread(work)
            except TomoskinError as error:
                page.post(Refusal(message=str(error)).json)
            else:
                then(outcome)

        self.keep(run())


FRAME_PERIOD = 1 / 60
"""A page gets no more frames than it can show, s."""

PATIENCE = 5.0
"""A page that takes nothing for this long is let go, s."""

MAX_PAGES = 16
"""Pages that are served at once."""

_OUTBOX = 64
_TRY_AGAIN_LATER = 1013


class Host(ABC):
    """Whom pages' connections are of; each message is encoded once for all pages.

    Attributes
    ----------
    pages
        The pages that are served.
    awaited
        Whether a page asks to be woken by the next frame.
    """

    def __init__(self) -> None:
        self.pages: set[Page] = set()
        self.awaited = False

    @abstractmethod
    def running(self) -> contextlib.AbstractAsyncContextManager[None]:
        """A block that lasts while it is served."""

    @abstractmethod
    def first(self) -> Iterable[Message]:
        """The messages that a new page is sent first."""

    @abstractmethod
    def newest(self) -> bytes | None:
        """The newest frame as a page takes it, the same object until there is another; None before
        the first."""

    def note_sent(self, frame: bytes) -> None:  # noqa: B027
        """Note that a page has the frame."""

    @abstractmethod
    def obey(self, page: Page, request: StrictRequest) -> None:
        """Do what a page asks. Raises WireError where that cannot be."""

    def join(self, page: Page) -> bool:
        """Serve ``page`` from now on; False where there are too many."""
        if len(self.pages) >= MAX_PAGES:
            return False
        self.pages.add(page)
        for message in self.first():
            page.post(message.json)
        return True

    def leave(self, page: Page, why: str = "") -> None:  # noqa: ARG002
        """Stop serving ``page``, whatever the reason."""
        self.pages.discard(page)

    def tell(self, *messages: Message) -> None:
        """Send ``messages`` to every page."""
        for text in [message.json for message in messages]:
            for page in self.pages:
                page.post(text)

    def wake(self) -> None:
        """Say to every page that there is a newer message."""
        for page in self.pages:
            page.wake()


class Page:
    """Serves one WebSocket until it is closed, or does not read for :data:`PATIENCE`.

    Frames are never queued: each time the page can take one, it gets the newest.
    """

    def __init__(self, socket: WebSocket, host: Host) -> None:
        self._socket = socket
        self._host = host
        self._outbox: deque[str] = deque(maxlen=_OUTBOX)
        self._due = asyncio.Event()
        self._sent: bytes | None = None

    def wake(self) -> None:
        """Say that there is something new to send."""
        self._due.set()

    def post(self, text: str) -> None:
        """Send ``text`` as soon as the page can take it; the oldest make room."""
        self._outbox.append(text)
        self._due.set()

    async def run(self) -> None:
        """Serve until either side ends it."""
        await self._socket.accept()
        if not self._host.join(self):
            await self._socket.close(_TRY_AGAIN_LATER, "too many pages are open: close one")
            return
        reason = ""
        tasks = {asyncio.create_task(self._read()), asyncio.create_task(self._write())}
        try:
            done, _ = await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)
            reason = _reason(done)
        finally:
            self._host.leave(self, reason)
            for task in tasks:
                task.cancel()
            await asyncio.gather(*tasks, return_exceptions=True)

    async def _read(self) -> None:
        while True:
            message = await self._socket.receive()
            if message["type"] == "websocket.disconnect":
                return
            self._answer(message.get("text"))

    def _answer(self, text: str | None) -> None:
        try:
            if text is None:
                raise WireError("expected text, got a binary message")
            self._host.obey(self, decode_request(text))
        except TomoskinError as error:
            self.post(Refusal(message=str(error)).json)

    async def _write(self) -> None:
        loop = asyncio.get_running_loop()
        with contextlib.suppress(WebSocketDisconnect, RuntimeError):
            while True:
                await self._due.wait()
                self._due.clear()
                self._host.awaited = True  # before it looks: what comes meanwhile wakes it
                following = loop.time() + FRAME_PERIOD
                async with asyncio.timeout(PATIENCE):
                    await self._send()
                await asyncio.sleep(following - loop.time())

    async def _send(self) -> None:
        while self._outbox:
            await self._socket.send_text(self._outbox.popleft())
            await asyncio.sleep(0)  # that the page is gone is said in the loop's next turn
        frame = self._host.newest()
        if frame is not None and frame is not self._sent:
            await self._socket.send_bytes(frame)
            self._sent = frame
            self._host.note_sent(frame)


def _reason(done: set[asyncio.Task[None]]) -> str:
    for task in done:
        error = task.exception()
        if isinstance(error, TimeoutError):
            return f"a page that received nothing for {PATIENCE:.0f} s was disconnected"
        if error is not None:
            return f"a page was disconnected: internal error, {type(error).__name__}: {error}"
    return ""
