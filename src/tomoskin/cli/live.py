"""``tomoskin live``: the main job, from a source to a page."""

from __future__ import annotations

import contextlib
import sys
import webbrowser
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Protocol

import typer

from tomoskin.cli.choices import chosen_sinks, say_headroom, skin_for_source
from tomoskin.cli.named_files import RECORDING, Added, Otherwise, Writes
from tomoskin.cli.options import CalibrationsOption, SinkOption, SkinsOption, SourcesOption
from tomoskin.cli.output import Bar, JsonFlag, emit, remark
from tomoskin.cli.record import ended_by_signals, recording_to

if TYPE_CHECKING:
    from socket import socket

    from tomoskin.pipeline import Prepared
    from tomoskin.run import Runner
    from tomoskin.server import AccessPolicy, Hub


@dataclass(frozen=True)
class Served:
    """How the page is served, and what is written while it is."""

    record: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Record the session to a new file, such as run.mcap."),
        Writes(RECORDING),
    ] = None
    folder: Annotated[
        Path,
        typer.Option(exists=True, file_okay=False, help="Folder for the page's files."),
        Otherwise("what the page writes gets a free name"),
    ] = Path()
    token_file: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE",
            help="File that keeps the token. Open pages then find the server after a restart.",
        ),
        Otherwise("created where there is none, else only read"),
    ] = None
    port: Annotated[
        int, typer.Option(min=0, max=65535, help="Port of the page; 0 chooses a free one.")
    ] = 8765
    host: Annotated[
        str, typer.Option(help="Address to listen on; 0.0.0.0 lets other machines reach the page.")
    ] = "127.0.0.1"
    open_browser: Annotated[bool, typer.Option("--open", help="Open the page in the browser.")] = (
        False
    )
    json: JsonFlag = False

    @contextlib.contextmanager
    def listening(self) -> Iterator[tuple[socket, AccessPolicy]]:
        """The socket of the page, and who may use it."""
        from tomoskin.server import AccessPolicy, is_loopback, listen, load_token

        with listen(self.host, self.port) as listener:
            if not is_loopback(self.host):
                remark(
                    f"warning: --host {self.host} lets other machines reach this page, "
                    "unencrypted; whoever has the address with its token can control it"
                )
            token = {} if self.token_file is None else {"token": load_token(self.token_file)}
            yield listener, AccessPolicy(listener.getsockname()[1], self.host, **token)

    def serve(self, app: Any, listener: socket, policy: AccessPolicy, text: str) -> None:
        """Until a signal comes; ``text`` says what is live, such as "two skins are live"."""
        from tomoskin.server import Server

        server = Server.of(app)
        with server.stopped_by_signals():
            if self.json:
                emit({"type": "listening", "address": policy.address, "port": policy.port})
            else:
                typer.echo(f"{text} at {policy.address}")
            sys.stdout.flush()
            if self.open_browser:
                webbrowser.open(policy.address)
            server.run_on(listener)

    def end(self, facts: dict[str, Any], stopped: Sequence[str]) -> None:
        """Say what there was, and fail where a recording has ``stopped`` by itself."""
        if self.json:
            emit({"type": "stopped", **facts, "recordings_ended": list(stopped)})
        if self.record is not None and stopped:
            raise typer.Exit(1)


class LiveOptions(Protocol):
    """What a record of options does that is added to ``live``."""

    def instead(
        self, skins: list[str], sources: list[str], calibrations: list[Path]
    ) -> Callable[[list[str] | None, Served, bool], None] | None:
        """What runs in place of one skin: it is given sinks, how the page is served, and whether
        drives tell of touches; None where one skin runs. Raises BadParameter."""


def live(
    *,
    added: Added,
    skin: SkinsOption = None,
    source: SourcesOption = None,
    calibration: CalibrationsOption = None,
    sink: SinkOption = None,
    early: Annotated[
        bool,
        typer.Option(
            "--early",
            help="Report touches before their scan ends, drive by drive, where the board can. "
            "Recordings hold whole frames as always.",
        ),
    ] = False,
    served: Served,
) -> None:
    """Run source, pipeline and server until a signal comes."""
    options: tuple[LiveOptions, ...] = added
    given = skin or [], source or [], calibration or []
    instead = next((run for one in options if (run := one.instead(*given)) is not None), None)
    if instead is None:
        check_one(*given[:2])
    with ended_by_signals():
        from tomoskin.run import prepared_for
        from tomoskin.server import check_page

        check_page()
        if instead is not None:
            instead(sink, served, early)
            return
        origin = source[0] if source else "twin"
        sinks = chosen_sinks(sink)
        with Bar("preparing"):
            recorded = skin is None and origin.startswith("replay:")
            chosen = None if recorded else skin_for_source(skin[0] if skin else None, origin)
            prepared = prepared_for(chosen, origin, calibration or ())
        say_headroom(prepared.headroom)
        _run_skin(prepared, origin, sinks, served, early=early)


def check_one(skins: list[str], sources: list[str]) -> None:
    """Raise BadParameter unless there is at most one skin, and one source for it."""
    for option, given in (("--skin", skins), ("--source", sources)):
        if len(given) > 1:
            raise typer.BadParameter(f"expected one, got {len(given)}", param_hint=option)


def _run_skin(
    prepared: Prepared, source: str, sinks: Sequence[Any], served: Served, *, early: bool
) -> None:
    from tomoskin.board.source import open_source
    from tomoskin.core import plain_values
    from tomoskin.learning import calibration_kinds
    from tomoskin.run import Runner
    from tomoskin.server import application, state

    opener = partial(open_source, source, prepared.skin)
    with served.listening() as (listener, policy):
        runner = Runner(prepared, opener, sinks=sinks, early=early)
        with recording_to(runner, served.record) as stopped:
            app = application(hub_of(runner, source, served.folder), policy)
            served.serve(app, listener, policy, f"{runner.flow.source} is live")
    status = runner.status()
    now = plain_values(state(status))
    document = {name: now[name] for name in ("frames", "p50_ms", "p99_ms", "stages")}
    for kind in calibration_kinds():
        if kind.reading is not None:
            reading = status.readings.get(kind.name)
            document[kind.reading.key] = reading and plain_values(reading.now)
    served.end({**document, "calibration": now["calibration"]}, stopped)


def hub_of(runner: Runner, source: str, folder: Path) -> Hub:
    """What serves the page of one skin, whose frames come from ``source``."""
    from tomoskin.board.source import open_source
    from tomoskin.server import Hub, serve_requests

    hub = Hub(runner, folder)
    hub.opener = partial(open_source, source)
    serve_requests(hub, source)
    return hub
