"""A server with all its flows, as a page meets them, and a twin that is pressed without a page."""

from __future__ import annotations

from contextlib import contextmanager

from server.serving import Site
from server.test_play import Page
from tomoskin.board.source import open_source
from tomoskin.run import Runner
from tomoskin.server import serve_requests


@contextmanager
def flowing(prepared, folder, spec="twin", opening=None):
    """(site, page) of a runner with the flows' desks, its files in ``folder``."""
    runner = Runner(prepared, opening or (lambda: open_source(spec, prepared.skin)))
    runner.start()
    site = Site(runner, folder=folder, take=lambda hub: serve_requests(hub, spec))
    try:
        with site.connect() as socket:
            yield site, Page(socket)
    finally:
        site.stop()
        runner.stop()
