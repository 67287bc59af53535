"""A page's connection, and one that is gone."""

import asyncio
from unittest.mock import AsyncMock

from starlette.websockets import WebSocket, WebSocketState

from tomoskin.server import Hub
from tomoskin.server.page_connection import Page

PATIENCE = 300


def test_a_page_that_vanishes_is_written_to_no_more(runner):
    """Its connection says so in the loop's next turn; asyncio warns of every later write."""
    hub, written, gone = Hub(runner), [], asyncio.Event()
    for number in range(20):
        runner.say("test", f"event {number}")

    async def receive():
        await gone.wait()
        return {"type": "websocket.disconnect"}

    async def send(message):
        if gone.is_set():
            raise OSError("gone")
        written.append(message["type"])
        if written[0] == "websocket.send":
            asyncio.get_running_loop().call_soon(gone.set)

    async def serve():
        async with hub.running():
            await asyncio.sleep(0)
            page = WebSocket({"type": "websocket"}, receive, send)
            page.client_state = page.application_state = WebSocketState.CONNECTED
            page.accept = lambda: asyncio.sleep(0)
            await asyncio.wait_for(Page(page, hub).run(), PATIENCE)

    asyncio.run(serve())
    assert written == ["websocket.send"]


def test_frames_wake_the_loop_only_where_a_page_asks_for_one(runner, monkeypatch):
    async def serve():
        hub, woken = Hub(runner), []
        async with hub.running():
            loop = asyncio.get_running_loop()
            monkeypatch.setattr(loop, "call_soon_threadsafe", woken.append)
            for asked in (False, True):
                hub.awaited = asked
                for _ in range(20):
                    runner.audience.wake()
                    await asyncio.sleep(0)
                assert len(woken) == asked

    asyncio.run(serve())


def test_an_internal_error_is_an_event_and_no_silent_reconnection(runner, monkeypatch):
    """A page that only opens again and again would say nothing of the cause."""
    hub, said = Hub(runner), []
    monkeypatch.setattr(runner, "say", lambda *event: said.append(event))
    monkeypatch.setattr(hub, "newest", lambda: {}["voltages"])

    async def serve():
        async with hub.running():
            page = WebSocket({"type": "websocket"}, asyncio.Event().wait, AsyncMock())
            page.client_state = page.application_state = WebSocketState.CONNECTED
            page.accept = AsyncMock()
            await asyncio.wait_for(Page(page, hub).run(), PATIENCE)

    asyncio.run(serve())
    assert said == [
        ("page-dropped", "a page was disconnected: internal error, KeyError: 'voltages'")
    ]
