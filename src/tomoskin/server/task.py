"""What a page asks for that takes its time: done in a thread, its refusal told to that page."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from typing import Any, TypeVar

import msgspec

from tomoskin.core import TomoskinError
from tomoskin.server import messages
from tomoskin.server.hub import Hub, Listener

_T = TypeVar("_T")


def run_errand(
    hub: Hub, page: Listener, work: Callable[[], _T], then: Callable[[_T], None]
) -> None:
    """Do ``work`` in a thread and ``then`` in the loop; what it raises goes to ``page``."""

    async def run() -> None:
        try:
            found = await asyncio.to_thread(work)
        except TomoskinError as error:
            page.post(messages.error(str(error)))
        else:
            then(found)

    hub.keep(run())


def text_of(**fields: Any) -> str:
    """A message to a page."""
    return msgspec.json.encode(fields).decode()
