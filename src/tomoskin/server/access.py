"""Who may use the server: the policy, and what applies it."""

from __future__ import annotations

import ipaddress
import os
import re
import secrets
import stat
from collections.abc import Mapping
from dataclasses import dataclass, field
from http.cookies import CookieError, SimpleCookie
from pathlib import Path
from urllib.parse import parse_qs

from starlette.datastructures import Headers
from starlette.responses import PlainTextResponse, RedirectResponse, Response
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from tomoskin.core import DataError, StrPath

LOOPBACK_NAMES = ("127.0.0.1", "localhost", "[::1]")
"""Names under which the server is always reached from this machine."""

_WILDCARDS = frozenset({"", "0.0.0.0", "::"})
_HTTP_PORT = 80
_TOKEN = re.compile(r"[A-Za-z0-9_-]{32,128}")


@dataclass(frozen=True, slots=True)
class AccessPolicy:
    """The rules for one server on one port.

    Attributes
    ----------
    port
        Port that the server listens on.
    host
        Name or address that it was bound to.
    token
        Secret that the printed address carries; without it there is no entry.
    """

    port: int
    host: str = "127.0.0.1"
    token: str = field(default_factory=lambda: secrets.token_urlsafe(24), repr=False)

    @property
    def address(self) -> str:
        """Address for the person at the keyboard, with the token."""
        name = "127.0.0.1" if self.host in _WILDCARDS else _bracketed(self.host)
        return f"http://{name}:{self.port}/?token={self.token}"

    @property
    def cookie(self) -> str:
        """Name of the cookie: cookies ignore ports, so the port is part of the name."""
        return f"tomoskin-{self.port}"

    def admits_host(self, host: str) -> bool:
        """Whether a Host header names this server.

        A page of another site can point its own name at this machine (DNS rebinding), but not
        an address: so where the server listens on every address, any literal address will do.
        """
        name, port = _split(host)
        if port != self.port:
            return False
        if name in LOOPBACK_NAMES or name == _bracketed(self.host).lower():
            return True
        return self.host in _WILDCARDS and _address(name) is not None and "%" not in name

    def admits_origin(self, origin: str | None, host: str) -> bool:
        """Whether a request with this Origin header may open a WebSocket on ``host``.

        Browsers always send an Origin with a WebSocket; programs that send none still need the
        token.
        """
        return origin is None or origin.lower() == f"http://{host.lower()}"

    def has_token(self, query: str) -> bool:
        """Whether a query string carries the right token."""
        given = parse_qs(query).get("token", [])
        return len(given) == 1 and self._same(given[0])

    def has_cookie(self, header: str) -> bool:
        """Whether a Cookie header carries the right token."""
        try:
            morsel = SimpleCookie(header).get(self.cookie)
        except CookieError:
            return False
        return morsel is not None and self._same(morsel.value)

    def set_cookie(self) -> str:
        """Set-Cookie header: out of reach of scripts, and never sent from another site."""
        return f"{self.cookie}={self.token}; Path=/; HttpOnly; SameSite=Strict"

    def _same(self, given: str) -> bool:
        return secrets.compare_digest(given.encode(), self.token.encode())


def answer_headers(host: str) -> Mapping[str, str]:
    """Headers of every answer: nothing from elsewhere, no inline script, no frame, no leak."""
    policy = (
        "default-src 'self'; img-src 'self' data:; "
        f"connect-src 'self' ws://{host}; "
        "object-src 'none'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
    )
    return {
        "content-security-policy": policy,
        "x-content-type-options": "nosniff",
        "x-frame-options": "DENY",
        "referrer-policy": "no-referrer",
        "cross-origin-opener-policy": "same-origin",
        "cross-origin-resource-policy": "same-origin",
        "cache-control": "no-store",
    }


def is_loopback(host: str) -> bool:
    """Whether only this machine can reach a server bound to ``host``."""
    address = _address(host)
    return host == "localhost" or (address is not None and address.is_loopback)


def load_token(path: StrPath) -> str:
    """The token in ``path``, made there when the file does not exist.

    Raises
    ------
    DataError
        When the file cannot be read or made, holds no token, or others may read it.
    """
    path = Path(path)
    try:
        handle = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600)
    except FileExistsError:
        return _read_token(path)
    except OSError as error:
        raise DataError(f"cannot be created: {error.strerror}", where=str(path)) from None
    with os.fdopen(handle, "w") as file:
        token = secrets.token_urlsafe(32)
        file.write(token + "\n")
    return token


def _split(host: str) -> tuple[str, int]:
    """Name and port of a Host header; port −1 where it is none."""
    name, colon, port = host.lower().rpartition(":")
    if not colon or "]" in port:
        return host.lower(), _HTTP_PORT
    digits = port.isascii() and port.isdigit() and len(port) <= 5
    return name, int(port) if digits else -1


def _bracketed(host: str) -> str:
    return f"[{host}]" if ":" in host and not host.startswith("[") else host


def _address(name: str) -> ipaddress.IPv4Address | ipaddress.IPv6Address | None:
    try:
        return ipaddress.ip_address(name.removeprefix("[").removesuffix("]"))
    except ValueError:
        return None


def _read_token(path: Path) -> str:
    try:
        mode = path.stat().st_mode
        text = path.read_text(encoding="ascii").strip()
    except (OSError, UnicodeDecodeError):
        raise DataError("cannot be read as a token file", where=str(path)) from None
    if os.name == "posix" and mode & (stat.S_IRWXG | stat.S_IRWXO):
        raise DataError(
            "other users of this machine can read this file and with it control the page",
            where=str(path),
            hint=f"chmod 600 {path}",
        )
    if not _TOKEN.fullmatch(text):
        raise DataError(
            "holds no token of tomoskin",
            where=str(path),
            hint="give the name of a new file, and tomoskin creates it",
        )
    return text


_STRANGE_HOST = "This server does not answer to that host name.\n"
_NO_TOKEN = "Open the address that tomoskin printed.\n"
_READ_ONLY = "This server answers only GET.\n"


class AccessControl:
    """ASGI application that lets through what its ``policy`` admits, and refuses the rest.

    Wrong Host, a foreign Origin and a missing token are answered 403 before the application
    sees anything.
    """

    def __init__(self, app: ASGIApp, policy: AccessPolicy) -> None:
        self._app = app
        self._policy = policy

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Serve one request, if it may be served."""
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
