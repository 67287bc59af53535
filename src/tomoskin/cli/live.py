"""``tomoskin live``: the main job, from a source to a page; or all skins of a robot on one."""

from __future__ import annotations

import contextlib
import itertools
import re
import sys
import webbrowser
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from tomoskin.cli.choices import chosen_sinks, say_headroom, skin_for_source
from tomoskin.cli.named_files import RECORDING, Otherwise, Reads, Writes
from tomoskin.cli.options import CalibrationsOption, SinkOption, SkinsOption, SourcesOption
from tomoskin.cli.output import Bar, JsonFlag, emit, remark
from tomoskin.cli.record import ended_by_signals, recording_to, troubles_told

if TYPE_CHECKING:
    from socket import socket

    from tomoskin.model.robot import Robot
    from tomoskin.pipeline import Prepared
    from tomoskin.run import RobotRun, Runner
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
    several = chosen_robot(robot, skin or [], source or [], calibration or [])
    with ended_by_signals():
        from tomoskin.run import prepared_for
        from tomoskin.server import check_page

        check_page()
        if several is not None:
            _run_robot(several, sink, served, early=early)
            return
        origin = source[0] if source else "twin"
        sinks = chosen_sinks(sink)
        with Bar("preparing"):
            recorded = skin is None and origin.startswith("replay:")
            chosen = None if recorded else skin_for_source(skin[0] if skin else None, origin)
            prepared = prepared_for(chosen, origin, calibration or ())
        say_headroom(prepared.headroom)
        _run_skin(prepared, origin, sinks, served, early=early)


def _run_skin(
    prepared: Prepared, source: str, sinks: Sequence[Any], served: Served, *, early: bool
) -> None:
    from tomoskin.board.source import open_source
    from tomoskin.core import plain_values
    from tomoskin.run import BoardMemory, Runner
    from tomoskin.server import application, state

    opener = partial(open_source, source, prepared.skin)
    with served.listening() as (listener, policy):
        runner = Runner(prepared, opener, sinks=sinks, memory=BoardMemory.in_cache(), early=early)
        with recording_to(runner, served.record) as stopped:
            app = application(_hub_of(runner, source, served.folder), policy)
            served.serve(app, listener, policy, f"{runner.flow.source} is live")
    now = plain_values(state(runner.status()))
    kept = ("frames", "p50_ms", "p99_ms", "stages", "bend", "class", "calibration")
    served.end({name: now[name] for name in kept}, stopped)


def _hub_of(runner: Runner, source: str, folder: Path) -> Hub:
    """What serves the page of one skin, whose frames come from ``source``."""
    from tomoskin.board.source import open_source
    from tomoskin.server import Hub, serve_requests

    hub = Hub(runner, folder)
    hub.opener = partial(open_source, source)
    serve_requests(hub, source)
    return hub


_NAMED = re.compile(r"[^=./\\]+=.+")
"""A skin with its name on the robot; not a path that has "=" in it, such as ./a=b.toml."""


def chosen_robot(
    file: Path | None, skins: list[str], sources: list[str], calibrations: list[Path]
) -> Robot | None:
    """That of a robot file, or of ``--skin NAME=SKIN``; None where one skin runs alone."""
    from tomoskin.model.robot import Robot

    if file is not None:
        if skins or sources or calibrations:
            raise typer.BadParameter(
                "--skin, --source and --calibration cannot be combined with --robot: "
                "the robot file names them"
            )
        return Robot.load(file)
    if sources and len(sources) != max(1, len(skins)):
        raise typer.BadParameter(
            f"expected no --source, or one for each --skin: {max(1, len(skins))}; got "
            f"{len(sources)}",
            param_hint="--source",
        )
    if len(skins) < 2 and not any(map(_NAMED.match, skins)):
        return None
    if calibrations:
        raise typer.BadParameter(
            "does not say to which skin it belongs: name the calibrations in a robot file",
            param_hint="--calibration",
        )
    given = [
        {"name": name, "skin": skin, "source": source}
        for (name, skin), source in zip(
            map(_named, skins), sources or ["twin"] * len(skins), strict=True
        )
    ]
    return Robot.of({"skin": given}, "command line", Path())


def _named(given: str) -> tuple[str, str]:
    if _NAMED.match(given) is None:
        raise typer.BadParameter(
            f'expected NAME=SKIN for each of several skins, got "{given}"', param_hint="--skin"
        )
    name, _, skin = given.partition("=")
    return name, skin


def _run_robot(robot: Robot, sinks: list[str] | None, served: Served, *, early: bool) -> None:
    """Run the skins of a robot and their page until a signal comes."""
    from tomoskin.run import BoardMemory, Member, RobotRun, with_joints

    robot = with_joints(robot)
    with Bar("preparing"):
        members = [
            Member.of(skin, skin_for_source(skin.skin, skin.source), chosen_sinks(sinks))
            for skin in robot.skins
        ]
    for member in members:
        if (problem := member.prepared.headroom.problem) is not None:
            remark(f"{member.place.name}: {problem}")
    run = RobotRun(members, BoardMemory.in_cache(), early=early)
    stopped = _serve_robot(robot, run, served)
    facts = {
        name: {"frames": s.frames, "p50_ms": 1e3 * s.p50, "p99_ms": 1e3 * s.p99}
        for name, s in run.statuses().items()
    }
    served.end({"skins": facts}, stopped)


def _serve_robot(robot: Robot, run: RobotRun, served: Served) -> list[str]:
    """Until a signal comes; why recordings have ended by themselves."""
    from tomoskin.server import Overview, robot_application

    ended: list[list[str]] = []
    with served.listening() as (listener, policy), contextlib.ExitStack() as stack:
        for skin, runner in run.runners.items():
            ended.append(stack.enter_context(troubles_told(runner, f"{skin}: ")))
        stack.callback(run.stop)
        run.start()
        if served.record is not None:
            run.record(served.record)
        overview = Overview(robot, run, served.folder)
        hubs = {s.name: _hub_of(run.runners[s.name], s.source, served.folder) for s in robot.skins}
        app = robot_application(overview, hubs, policy)
        served.serve(app, listener, policy, f"{len(robot.skins)} skins of {robot.name} are live")
    return list(itertools.chain(*ended))
