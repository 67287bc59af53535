"""What a page asks for that takes its time: done outside the event loop, its refusal sent back."""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import AsyncIterator, Callable, Coroutine, Mapping
from typing import Any, Protocol, TypeVar

from tomoskin.core import TomoskinError
from tomoskin.server.page_messages import Refusal

_T = TypeVar("_T")


class Listener(Protocol):
    """What a handler needs of a page's connection."""

    def wake(self) -> None:
        """Say that there is a new frame."""

    def post(self, text: str) -> None:
        """Send ``text`` soon, without waiting for it."""


Handler = Callable[[Listener, Any], None]
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

    def run(self, page: Listener, work: Callable[[], _T], then: Callable[[_T], None]) -> None:
        """Do ``work`` in a thread and ``then`` in the loop; what it raises goes to ``page``."""

        async def run() -> None:
            try:
                outcome = await asyncio.to_thread(work)
            except TomoskinError as error:
                page.post(Refusal(message=str(error)).json)
            else:
                then(outcome)

        self.keep(run())
