"""What a page of one skin and that of a whole robot have in common: hubs, and where they are."""

from __future__ import annotations

import sys
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from tomoskin.cli.output import emit

if TYPE_CHECKING:
    from tomoskin.run import Runner
    from tomoskin.server import AccessPolicy, Hub


def hub_of(runner: Runner, source: str, folder: Path) -> Hub:
    """What serves the page of one skin, whose frames come from ``source``."""
    from tomoskin.board.source import open_source
    from tomoskin.pipeline import colour_limit
    from tomoskin.server import Hub, serve_requests

    hub = Hub(runner, limit=colour_limit(runner.prepared), folder=folder)
    hub.opener = partial(open_source, source)
    serve_requests(hub, source)
    return hub


def announce(policy: AccessPolicy, text: str, *, json: bool) -> None:
    """Say where the page is: ``text``, such as "two skins are live", and the address."""
    if json:
        emit({"type": "listening", "address": policy.address, "port": policy.port})
    else:
        typer.echo(f"{text} at {policy.address}")
    sys.stdout.flush()
