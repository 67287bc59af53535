"""``tomoskin live``: the main job, from a source to a page."""

from __future__ import annotations

import contextlib
import signal
import sys
import webbrowser
from collections.abc import Iterator
from typing import TYPE_CHECKING, Annotated

import typer

from tomoskin.cli.output import JsonFlag, emit

if TYPE_CHECKING:
    from tomoskin.live import Door, Runner

_DEFAULT_SKIN = "textile-disc-8"


def live(
    *,
    skin: Annotated[str, typer.Option(help="Built-in name or path.")] = _DEFAULT_SKIN,
    source: Annotated[str, typer.Option(help="twin, serial:PORT, …")] = "twin",
    port: Annotated[int, typer.Option(min=0, max=65535, help="0 takes a free one.")] = 8765,
    host: Annotated[
        str, typer.Option(help="Address to listen on; others than this machine can reach it.")
    ] = "127.0.0.1",
    open_browser: Annotated[
        bool, typer.Option("--open", help="Open the page in the browser.")
    ] = False,
    json: JsonFlag = False,
) -> None:
    """Show a skin live on a page; without options, the twin of a textile disc."""
    with _ended_by_signals():
        from tomoskin import live as room
        from tomoskin.skin import Skin
        from tomoskin.source import open_source

        room.check_page()
        chosen = Skin.load(skin)
        with room.listen(host, port) as listener:
            if not room.is_loopback(host):
                _warn(host)
            door = room.Door(listener.getsockname()[1], host)
            runner = room.Runner(room.prepare(chosen), lambda: open_source(source, chosen))
            runner.start()
            try:
                hub = room.Hub(runner, limit=room.colour_limit(runner.prepared))
                server = room.Server.of(room.application(hub, door))
                with server.stopped_by_signals():
                    _announce(door, runner, json=json)
                    if open_browser:
                        webbrowser.open(door.address)
                    server.run_on(listener)
            finally:
                runner.stop()
        _farewell(runner, json=json)


@contextlib.contextmanager
def _ended_by_signals() -> Iterator[None]:
    """Ctrl-C and SIGTERM end the block, wherever it stands: that is no failure."""
    before = signal.signal(signal.SIGTERM, signal.default_int_handler)
    try:
        with contextlib.suppress(KeyboardInterrupt):
            yield
    finally:
        signal.signal(signal.SIGTERM, before)


def _warn(host: str) -> None:
    typer.echo(
        f"tomoskin: warning: --host {host} lets other machines reach this page, unencrypted; "
        "whoever has the address with its token can control it",
        err=True,
    )


def _announce(door: Door, runner: Runner, *, json: bool) -> None:
    if json:
        emit({"type": "listening", "address": door.address, "port": door.port})
    else:
        typer.echo(f"{runner.source} is live at {door.address}")
    sys.stdout.flush()


def _farewell(runner: Runner, *, json: bool) -> None:
    status = runner.status()
    if json:
        emit({"type": "stopped", "frames": status.frames, "p50_ms": 1e3 * status.p50})
