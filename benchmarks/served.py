"""A page's server for as long as a block lasts."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from contextlib import contextmanager

from tomoskin.pipeline import colour_limit
from tomoskin.run import Runner
from tomoskin.server import AccessPolicy, Hub, Server, application, listen


@contextmanager
def served(runner: Runner) -> Iterator[AccessPolicy]:
    """Serve the page of ``runner`` on a free port; who may read it, with the port."""
    listener = listen("127.0.0.1", 0)
    policy = AccessPolicy(listener.getsockname()[1])
    server = Server.of(application(Hub(runner, limit=colour_limit(runner.prepared)), policy))
    thread = threading.Thread(target=server.run_on, args=(listener,))
    thread.start()
    try:
        yield policy
    finally:
        server.stop()
        thread.join()
