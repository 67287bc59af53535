"""The access policy in front of the application: every request passes here first."""

from __future__ import annotations

from starlette.datastructures import Headers
from starlette.responses import PlainTextResponse, RedirectResponse, Response
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from tomoskin.server.access_policy import AccessPolicy, answer_headers

_STRANGE_HOST = "This server does not answer under that name.\n"
_NO_TOKEN = "Open the address that tomoskin printed.\n"
_READ_ONLY = "Only GET is answered here.\n"


class AccessControl:
    """ASGI application that lets through what its ``policy`` admits, and refuses the rest.

    Wrong Host, a foreign Origin and a missing token are answered 403 before the application
    sees anything.
    """

    def __init__(self, app: ASGIApp, policy: AccessPolicy) -> None:
        self._app = app
        self._policy = policy

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
        ours = self._policy.admits_host(host)
        answer = self._refusal(scope, headers, ours=ours) or self._entry(scope)
        with_headers = _with_headers(send, host if ours else "invalid")
        await (answer or self._app)(scope, receive, with_headers)

    def _refusal(self, scope: Scope, headers: Headers, *, ours: bool) -> Response | None:
        if not ours:
            return PlainTextResponse(_STRANGE_HOST, 403)
        if scope["method"] not in ("GET", "HEAD"):
            return PlainTextResponse(_READ_ONLY, 405, {"allow": "GET, HEAD"})
        if not self._admits(scope, headers):
            return PlainTextResponse(_NO_TOKEN, 403)
        return None

    def _entry(self, scope: Scope) -> Response | None:
        """The token becomes a cookie, so that it leaves the address bar and the history."""
        if scope["path"] != "/" or not self._policy.has_token(_query(scope)):
            return None
        return RedirectResponse("/", 303, {"set-cookie": self._policy.set_cookie()})

    async def _websocket(self, scope: Scope, receive: Receive, send: Send) -> None:
        headers = Headers(scope=scope)
        host = headers.get("host", "")
        if (
            self._policy.admits_host(host)
            and self._policy.admits_origin(headers.get("origin"), host)
            and self._admits(scope, headers)
        ):
            await self._app(scope, receive, send)
        else:
            await receive()
            await send({"type": "websocket.close", "code": 1008})

    def _admits(self, scope: Scope, headers: Headers) -> bool:
        cookies = "; ".join(headers.getlist("cookie"))
        return self._policy.has_cookie(cookies) or self._policy.has_token(_query(scope))


def _query(scope: Scope) -> str:
    return bytes(scope.get("query_string", b"")).decode("latin-1")


def _with_headers(send: Send, host: str) -> Send:
    extra = [(k.encode(), v.encode("latin-1")) for k, v in answer_headers(host).items()]

    async def send_with_headers(message: Message) -> None:
        if message["type"] == "http.response.start":
            message["headers"] = [*message.get("headers", []), *extra]
        await send(message)

    return send_with_headers
