"""The real server in a thread, as tests meet it."""

import socket
import threading
from contextlib import contextmanager

import httpx
from websockets.sync.client import connect

from tomoskin.server import AccessPolicy, Hub, Server, application, listen
from tomoskin.server.server import STATIC

PATIENCE = 300


class Site:
    """A running server; the runner is the test's own and already started."""

    def __init__(
        self, runner, static=STATIC, *, folder=None, take=lambda _hub: None, token=None, port=0
    ):
        self.runner = runner
        self._listener = listen("127.0.0.1", port)
        self.port = self._listener.getsockname()[1]
        self.policy = (
            AccessPolicy(self.port) if token is None else AccessPolicy(self.port, token=token)
        )
        self.origin = f"http://127.0.0.1:{self.port}"
        hub = Hub(runner, folder)
        take(hub)
        self._server = Server.of(application(hub, self.policy, static))
        self._thread = threading.Thread(target=self._server.run_on, args=(self._listener,))
        self._thread.start()

    def stop(self):
        self._server.stop()
        self._thread.join(PATIENCE)
        assert not self._thread.is_alive()

    @contextmanager
    def client(self, *, entered=True):
        with httpx.Client(base_url=self.origin, trust_env=False) as client:
            if entered:
                client.get("/", params={"token": self.policy.token})
            yield client

    @contextmanager
    def connect(self, *, token=None, host="127.0.0.1", cookie=None, origin="own"):
        """WebSocket as a browser would open it, from that origin and to that name."""
        query = self.policy.token if token is None else token
        with (
            socket.create_connection(("127.0.0.1", self.port)) as plain,
            connect(
                f"ws://{host}:{self.port}/ws?token={query}",
                origin=self.origin if origin == "own" else origin,
                additional_headers={"Cookie": cookie} if cookie else {},
                sock=plain,
            ) as page,
        ):
            yield page
