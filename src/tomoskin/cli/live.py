"""``tomoskin live``: the main job, from a source to a page."""

from __future__ import annotations

import webbrowser
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from tomoskin.cli.choices import (
    board_memory,
    chosen_sinks,
    say_headroom,
    skin_for_source,
    with_calibrations,
)
from tomoskin.cli.named_files import RECORDING, Otherwise, Reads, Writes
from tomoskin.cli.options import CalibrationsOption, SinkOption, SkinsOption, SourcesOption
from tomoskin.cli.output import Bar, JsonFlag, emit, remark
from tomoskin.cli.record import ended_by_signals, recording_to
from tomoskin.cli.several_skins import Served, announce, chosen_robot, hub_of, run_robot

if TYPE_CHECKING:
    from tomoskin.pipeline import Prepared
    from tomoskin.run import Runner


def live(
    *,
    robot: Annotated[
        Path | None,
        typer.Option(
            metavar="ROBOT.toml",
            help="Robot file: run all its skins, instead of --skin and --source.",
        ),
        Reads(),
    ] = None,
    skin: SkinsOption = None,
    source: SourcesOption = None,
    record: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Record the session to a new file, such as run.mcap."),
        Writes(RECORDING),
    ] = None,
    calibration: CalibrationsOption = None,
    folder: Annotated[
        Path,
        typer.Option(exists=True, file_okay=False, help="Folder for the page's files."),
        Otherwise("what the page writes gets a free name"),
    ] = Path(),
    token_file: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE",
            help="File that keeps the token. Open pages then find the server after a restart.",
        ),
        Otherwise("created where there is none, else only read"),
    ] = None,
    sink: SinkOption = None,
    port: Annotated[
        int, typer.Option(min=0, max=65535, help="Port of the page; 0 chooses a free one.")
    ] = 8765,
    host: Annotated[
        str, typer.Option(help="Address to listen on; 0.0.0.0 lets other machines reach the page.")
    ] = "127.0.0.1",
    open_browser: Annotated[
        bool, typer.Option("--open", help="Open the page in the browser.")
    ] = False,
    json: JsonFlag = False,
) -> None:
    """Run source, pipeline and server until a signal comes."""
    from tomoskin.server import is_loopback

    several = chosen_robot(robot, skin or [], source or [], calibration or [])
    if several is not None:
        served = Served(host, port, _token(token_file), folder, record, open_browser, json)
        if not is_loopback(host):
            _warn(host)
        run_robot(several, sink, served)
        return
    named, origin = skin[0] if skin else None, source[0] if source else "twin"
    with ended_by_signals():
        from tomoskin.board.source import open_source
        from tomoskin.run import Runner
        from tomoskin.server import AccessPolicy, Server, application, check_page, listen

        check_page()
        sinks = chosen_sinks(sink)
        with Bar("preparing"):
            prepared = _prepared(named, origin)
            prepared = with_calibrations(prepared, calibration, prepared.skin)
        say_headroom(prepared.headroom)
        chosen = prepared.skin
        with listen(host, port) as listener:
            if not is_loopback(host):
                _warn(host)
            port = listener.getsockname()[1]
            policy = AccessPolicy(port, host, **_token(token_file))
            runner = Runner(
                prepared, lambda: open_source(origin, chosen), sinks=sinks, memory=board_memory()
            )
            with recording_to(runner, record) as stopped:
                server = Server.of(application(hub_of(runner, origin, folder), policy))
                with server.stopped_by_signals():
                    announce(policy, f"{runner.status().source} is live", json=json)
                    if open_browser:
                        webbrowser.open(policy.address)
                    server.run_on(listener)
        _farewell(runner, stopped, json=json)
        if record is not None and stopped:
            raise typer.Exit(1)


def _prepared(skin: str | None, source: str) -> Prepared:
    """The skin, of a recording with the calibrations that it holds."""
    from tomoskin.files.session import SessionReader, as_recorded, parse_replay
    from tomoskin.pipeline import prepare

    name, _, argument = source.partition(":")
    if skin is None and name == "replay":
        with SessionReader(parse_replay(argument)[0]) as session:
            return as_recorded(session)
    return prepare(skin_for_source(skin, source))


def _token(token_file: Path | None) -> dict[str, str]:
    from tomoskin.server import load_token

    return {} if token_file is None else {"token": load_token(token_file)}


def _warn(host: str) -> None:
    remark(
        f"warning: --host {host} lets other machines reach this page, unencrypted; "
        "whoever has the address with its token can control it"
    )


def _farewell(runner: Runner, stopped: Sequence[str], *, json: bool) -> None:
    from tomoskin.core import plain_values
    from tomoskin.server import state

    if json:
        now = plain_values(state(runner.status()))
        kept = ("frames", "p50_ms", "p99_ms", "stages", "bend", "class", "calibration")
        said = {name: now[name] for name in kept}
        emit({"type": "stopped", **said, "recordings_ended": list(stopped)})
