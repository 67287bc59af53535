"""The page's server: an application behind its access policy, on a socket of its own."""

from __future__ import annotations

import asyncio
import contextlib
import errno
import mimetypes
import signal
import socket
from collections.abc import AsyncIterator, Callable, Iterator, Mapping, Sequence
from functools import partial
from pathlib import Path

import uvicorn
from starlette.applications import Starlette
from starlette.requests import Request
from starlette.responses import FileResponse, PlainTextResponse, Response
from starlette.routing import BaseRoute, Mount, Route, WebSocketRoute
from starlette.staticfiles import StaticFiles
from starlette.types import ASGIApp
from starlette.websockets import WebSocket
from websockets.exceptions import InvalidState

from tomoskin.core import DataError, StrPath, TomoskinError
from tomoskin.server import views
from tomoskin.server.access import AccessControl, AccessPolicy
from tomoskin.server.door import Door
from tomoskin.server.hub import Hub
from tomoskin.server.page_connection import PATIENCE, Host, Page

STATIC = Path(__file__).parent / "static"
"""Where the built page lies."""

DEFAULT_PORT = 8765

_MOST_PER_MESSAGE = 64 * 1024
_UNDERWAY = 64 * 1024
"""Bytes that may wait in the kernel for one page: what waits there is no longer the newest."""
_GRACE = 2
_SIGNALS = (signal.SIGINT, signal.SIGTERM)


class ServerError(TomoskinError):
    """The page cannot be served: port in use, address not of this machine, page not built."""


def check_page(static: StrPath = STATIC) -> None:
    """Raise ServerError when the page has not been built."""
    static = Path(static)
    if not (static / "index.html").is_file():
        raise ServerError(
            "the page has not been built", where="page", hint='build and start it with "make live"'
        )


def listen(host: str, port: int) -> socket.socket:
    """Socket that listens on ``host`` and ``port``; port 0 takes a free one.

    Raises
    ------
    ServerError
        When the port is taken or the host is not an address of this machine.
    """
    try:
        family, kind, protocol, _, address = socket.getaddrinfo(
            host or None, port, type=socket.SOCK_STREAM, flags=socket.AI_PASSIVE
        )[0]
        listener = socket.socket(family, kind, protocol)
    except OSError as error:
        raise ServerError(f"{error.strerror}", where=f"host {host}") from None
    try:
        listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        listener.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, _UNDERWAY)
        _limit_stalled(listener)
        listener.bind(address)
        listener.listen()
    except OSError as error:
        listener.close()
        raise _refused(error, host, port) from None
    return listener


def application(hub: Hub, policy: AccessPolicy, static: StrPath = STATIC) -> ASGIApp:
    """ASGI application: the built page, ``/ws`` for each open page, ``/status`` for programs,
    ``/files/NAME`` for what is in the session folder."""
    return _guarded([*_routes(hub), _page(Path(static))], [hub], policy)


def application_of_several(
    host: Host,
    state: Callable[[], str],
    hubs: Mapping[str, Hub],
    policy: AccessPolicy,
    page: Path,
) -> ASGIApp:
    """ASGI application: the ``page`` of several skins, a file beside that of one, with the ``/ws``
    of its ``host`` and the ``state`` for programs at ``/status``; below ``/skin/NAME/`` what
    :func:`application` has of one skin."""
    static = page.parent
    skins = (Mount(f"/skin/{n}", routes=[*_routes(h), _page(static)]) for n, h in hubs.items())
    routes = [
        *_ends(host, state),
        Route("/", partial(_file, page)),
        *skins,
        _page(static),
    ]
    return _guarded(routes, [host, *hubs.values()], policy)


def _routes(hub: Hub) -> list[BaseRoute]:
    """Of one skin, but for the page itself."""

    async def download(request: Request) -> Response:
        name = request.path_params["name"]
        try:
            path = hub.folder.existing(name)
        except DataError as error:
            return PlainTextResponse(f"{error}\n", 404)
        return FileResponse(path, media_type="application/octet-stream", filename=name)

    ends = _ends(hub, lambda: views.state(hub.runner.status()).json)
    return [*ends, Route("/files/{name}", download)]


def _ends(host: Host, state: Callable[[], str]) -> list[BaseRoute]:
    """A socket for each open page, and the state for programs."""

    async def stream(websocket: WebSocket) -> None:
        await Page(websocket, host).run()

    async def status(_: Request) -> Response:
        return Response(state(), media_type="application/json")

    return [WebSocketRoute("/ws", stream), Route("/status", status)]


def _page(static: Path) -> BaseRoute:
    """The route to the built page."""
    # Whether Python knows the page's typeface depends on its version and on the machine's list.
    mimetypes.add_type("font/woff2", ".woff2")
    return Mount("/", StaticFiles(directory=static, html=True))


async def _file(path: Path, _: Request) -> Response:
    return FileResponse(path)


async def _no_icon(_: Request) -> Response:
    return Response(status_code=204)


def _guarded(routes: Sequence[BaseRoute], hosts: Sequence[Host], policy: AccessPolicy) -> ASGIApp:
    """Behind the access policy; all ``hosts`` run while it is served."""

    @contextlib.asynccontextmanager
    async def lifespan(_: Starlette) -> AsyncIterator[None]:
        async with contextlib.AsyncExitStack() as stack:
            for host in hosts:
                await stack.enter_async_context(host.running())
            yield

    served = Starlette(routes=[Route("/favicon.ico", _no_icon), *routes], lifespan=lifespan)
    return AccessControl(served, policy)


class Server(uvicorn.Server):
    """Serves until :meth:`stop`; leaves signals to :meth:`stopped_by_signals`."""

    @classmethod
    def of(cls, app: ASGIApp) -> Server:
        """Server with bounded messages and no chatter."""
        return cls(
            uvicorn.Config(
                app,
                http=Door,
                lifespan="on",
                log_config=None,
                log_level="critical",
                access_log=False,
                server_header=False,
                ws_max_size=_MOST_PER_MESSAGE,
                ws_per_message_deflate=False,
                timeout_graceful_shutdown=_GRACE,
            )
        )

    def run_on(self, listener: socket.socket) -> None:
        """Serve on ``listener`` until stopped; closes it."""
        asyncio.run(self.serve([listener]))

    async def shutdown(self, sockets: list[socket.socket] | None = None) -> None:
        """End all connections: those too that a page closes at that very moment, or never reads."""
        try:
            await super().shutdown(sockets)
        except InvalidState:  # the base class stops there
            await self.lifespan.shutdown()
        finally:
            for connection in list(self.server_state.connections):
                connection.transport.abort()
            await asyncio.sleep(0)  # that they are lost is said in the loop's next turn

    def stop(self) -> None:
        """End :meth:`run_on`, or let it end at once when it begins; callable from any thread."""
        self.should_exit = True

    @contextlib.contextmanager
    def stopped_by_signals(self) -> Iterator[None]:
        """While the block lasts, SIGINT and SIGTERM stop the server, and do nothing else."""
        before = {s: signal.signal(s, lambda *_: self.stop()) for s in _SIGNALS}
        try:
            yield
        finally:
            for number, handler in before.items():
                signal.signal(number, handler)

    @contextlib.contextmanager
    def capture_signals(self) -> Iterator[None]:
        """Nothing: the base class would raise the signal again after a clean end."""
        yield


def _limit_stalled(listener: socket.socket) -> None:
    """Let the kernel end connections whose other side takes nothing, even after we let go."""
    option = getattr(socket, "TCP_USER_TIMEOUT", None)
    if option is not None:
        listener.setsockopt(socket.IPPROTO_TCP, option, int(2e3 * PATIENCE))


_REFUSALS = {
    errno.EADDRINUSE: (
        *("the port is in use, perhaps by another tomoskin", "port"),
        "choose another with --port, or a free one with --port 0",
    ),
    errno.EACCES: (
        *("you have no permission to use this port", "port"),
        "choose one above 1023 with --port",
    ),
    errno.EADDRNOTAVAIL: (
        *("is not an address of this machine", "host"),
        "choose one of its own with --host, such as 127.0.0.1",
    ),
}
"""Why the system refuses to listen: in words, at which option, and what to do."""


def _refused(error: OSError, host: str, port: int) -> ServerError:
    message, option, hint = _REFUSALS.get(error.errno or 0, (f"{error.strerror}", "host", ""))
    return ServerError(message, where=f"{option} {port if option == 'port' else host}", hint=hint)
