"""The door keeper in front of the application: every request passes here first."""

from __future__ import annotations

from starlette.datastructures import Headers
from starlette.responses import PlainTextResponse, RedirectResponse, Response
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from tomoskin.server.security import Door, answer_headers

_STRANGE_HOST = "This server does not answer under that name.\n"
_NO_TOKEN = "Open the address that tomoskin printed.\n"
_READ_ONLY = "Only GET is answered here.\n"


class Guard:
    """ASGI application that lets through what its ``door`` knows, and refuses the rest.

    Wrong Host, a foreign Origin and a missing token are answered 403 before the application
    sees anything.
    """

    def __init__(self, app: ASGIApp, door: Door) -> None:
        self._app = app
        self._door = door

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Serve one request."""
        if scope["type"] == "http":
            await self._http(scope, receive, send)
        elif scope["type"] == "websocket":
            await self._websocket(scope, receive, send)
        else:
            await self._app(scope, receive, send)

    async def _http(self, scope: Scope, receive: Receive, send: Send) -> None:
        headers = Headers(scope=scope)
        host = headers.get("host", "")
        known = self._door.knows_host(host)
        answer = self._refusal(scope, headers, known) or self._entry(scope)
        await (answer or self._app)(scope, receive, _dressed(send, host if known else "invalid"))

    def _refusal(self, scope: Scope, headers: Headers, known: bool) -> Response | None:
        if not known:
            return PlainTextResponse(_STRANGE_HOST, 403)
        if scope["method"] not in ("GET", "HEAD"):
            return PlainTextResponse(_READ_ONLY, 405, {"allow": "GET, HEAD"})
        if not self._admits(scope, headers):
            return PlainTextResponse(_NO_TOKEN, 403)
        return None

    def _entry(self, scope: Scope) -> Response | None:
        """The token becomes a cookie, so that it leaves the address bar and the history."""
        if scope["path"] != "/" or not self._door.has_token(_query(scope)):
            return None
        return RedirectResponse("/", 303, {"set-cookie": self._door.set_cookie()})

    async def _websocket(self, scope: Scope, receive: Receive, send: Send) -> None:
        headers = Headers(scope=scope)
        host = headers.get("host", "")
        if (
            self._door.knows_host(host)
            and self._door.knows_origin(headers.get("origin"), host)
            and self._admits(scope, headers)
        ):
            await self._app(scope, receive, send)
        else:
            await receive()
            await send({"type": "websocket.close", "code": 1008})

    def _admits(self, scope: Scope, headers: Headers) -> bool:
        cookies = "; ".join(headers.getlist("cookie"))
        return self._door.has_cookie(cookies) or self._door.has_token(_query(scope))


def _query(scope: Scope) -> str:
    return bytes(scope.get("query_string", b"")).decode("latin-1")


def _dressed(send: Send, host: str) -> Send:
    extra = [(k.encode(), v.encode("latin-1")) for k, v in answer_headers(host).items()]

    async def dressed(message: Message) -> None:
        if message["type"] == "http.response.start":
            message["headers"] = [*message.get("headers", []), *extra]
        await send(message)

    return dressed
