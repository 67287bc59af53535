"""All skins of a robot live on one page, and ``tomoskin skin place``."""

from __future__ import annotations

import contextlib
import itertools
import re
import sys
import webbrowser
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from os import path
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from tomoskin.cli.choices import board_memory, chosen_sinks, skin_for_source, with_calibrations
from tomoskin.cli.named_files import Otherwise, Reads
from tomoskin.cli.options import DEFAULT_SKIN, NamedSkinOption
from tomoskin.cli.output import Bar, emit, remark
from tomoskin.cli.record import ended_by_signals, troubles_told

if TYPE_CHECKING:
    from tomoskin.model.robot import PlacedSkin, Robot
    from tomoskin.pipeline import Prepared
    from tomoskin.run import Member, RobotRun, Runner
    from tomoskin.server import AccessPolicy, Hub

_NAMED = re.compile(r"[^=./\\]+=.+")
"""A skin with its name on the robot; not a path that has "=" in it, such as ./a=b.toml."""


@dataclass(frozen=True)
class Served:
    """How the page of a robot is served, as the options of ``live`` say it."""

    host: str
    port: int
    token: Mapping[str, str]
    folder: Path
    record: Path | None
    open_browser: bool
    json: bool


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
    twins = [f"twin:seed={number}" for number in range(1, len(skins) + 1)]
    given = [
        {"name": name, "skin": skin, "source": source}
        for (name, skin), source in zip(map(_named, skins), sources or twins, strict=True)
    ]
    return Robot.of({"skin": given}, "command line", Path())


def _named(given: str) -> tuple[str, str]:
    if _NAMED.match(given) is None:
        raise typer.BadParameter(
            f'expected NAME=SKIN for each of several skins, got "{given}"', param_hint="--skin"
        )
    name, _, skin = given.partition("=")
    return name, skin


def run_robot(robot: Robot, sinks: list[str] | None, served: Served) -> None:
    """Run the skins of a robot and their page until a signal comes."""
    from tomoskin.run import RobotRun
    from tomoskin.server import check_page

    check_page()
    with ended_by_signals():
        with Bar("preparing"):
            members = [_member(skin, sinks) for skin in robot.skins]
        run = RobotRun(members, board_memory())
        stopped = _serve(robot, run, served)
        _farewell(run, stopped, json=served.json)
        if served.record is not None and stopped:
            raise typer.Exit(1)


def _member(skin: PlacedSkin, sinks: list[str] | None) -> Member:
    from tomoskin.board.source import open_source
    from tomoskin.run import Member

    prepared = _prepared(skin)
    if prepared.headroom.problem is not None:
        remark(f"{skin.name}: {prepared.headroom.problem}")
    opened = partial(open_source, skin.source, prepared.skin)
    return Member(skin.place, prepared, opened, chosen_sinks(sinks), skin.board)


def _prepared(skin: PlacedSkin) -> Prepared:
    """With the calibrations that the robot file names."""
    from tomoskin.pipeline import prepare

    chosen = skin_for_source(skin.skin, skin.source)
    return with_calibrations(prepare(chosen), skin.calibrations, chosen)


def _serve(robot: Robot, run: RobotRun, served: Served) -> list[str]:
    """Until a signal comes; why recordings have ended by themselves."""
    from tomoskin.server import AccessPolicy, Overview, Server, listen, robot_application

    ended: list[list[str]] = []
    with listen(served.host, served.port) as listener:
        policy = AccessPolicy(listener.getsockname()[1], served.host, **served.token)
        with contextlib.ExitStack() as stack:
            for skin, runner in run.runners.items():
                ended.append(stack.enter_context(troubles_told(runner, f"{skin}: ")))
            stack.callback(run.stop)
            run.start()
            if served.record is not None:
                run.record(served.record)
            overview = Overview(robot, run, served.folder)
            hubs = {
                s.name: hub_of(run.runners[s.name], s.source, served.folder) for s in robot.skins
            }
            server = Server.of(robot_application(overview, hubs, policy))
            with server.stopped_by_signals():
                live = f"{len(robot.skins)} skins of {robot.name} are live"
                announce(policy, live, json=served.json)
                if served.open_browser:
                    webbrowser.open(policy.address)
                server.run_on(listener)
    return list(itertools.chain(*ended))


def _farewell(run: RobotRun, stopped: Sequence[str], *, json: bool) -> None:
    if json:
        skins = {
            name: {"frames": s.frames, "p50_ms": 1e3 * s.p50, "p99_ms": 1e3 * s.p99}
            for name, s in run.statuses().items()
        }
        emit({"type": "stopped", "skins": skins, "recordings_ended": list(stopped)})


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


def place(
    urdf: Annotated[Path, typer.Argument(metavar="ROBOT.urdf", help="The robot."), Reads()],
    link: Annotated[str, typer.Argument(help="Link that the skin lies on.")],
    out: Annotated[
        Path,
        typer.Option(
            metavar="ROBOT.toml",
            help="Robot file: the skin is added to it, or a new file is created.",
        ),
        Otherwise("the skin is added to the file"),
    ] = Path("robot.toml"),
    skin: NamedSkinOption = DEFAULT_SKIN,
    name: Annotated[
        str | None,
        typer.Option(help="Name of the skin on the robot. Default: the name of the link."),
    ] = None,
    source: Annotated[
        str | None,
        typer.Option(help="Source of its frames: serial:PORT, replay:FILE, … Default: a twin."),
    ] = None,
    at: Annotated[
        str | None,
        typer.Option(
            metavar="X/Y/Z[/ROLL/PITCH/YAW]",
            help="Pose of the skin's frame in the link's frame, in mm and degrees.",
        ),
    ] = None,
    on_mesh: Annotated[
        bool,
        typer.Option(
            "--on-mesh", help="The skin's surface file uses the coordinates of the link's mesh."
        ),
    ] = False,
) -> None:
    """Lay a skin on a link of a robot: add it to a robot file, for `tomoskin live --robot`."""
    from tomoskin.core import write_text
    from tomoskin.model.robot import Robot, Urdf, add_skin
    from tomoskin.model.skin import Skin

    found = Urdf.read(urdf)
    found.check_link(link, "LINK")
    Skin.load(skin)
    earlier = Robot.load(out).skins if out.exists() else ()
    given: dict[str, Any] = {
        "name": name or _name_of(link),
        "skin": _from(skin, out) if skin.endswith(".toml") else skin,
        "source": source or f"twin:seed={len(earlier) + 1}",
        "link": link,
    } | _pose(found, link, at, on_mesh=on_mesh)
    text = add_skin(out, given, _from(str(urdf), out))
    before = out.read_text(encoding="utf-8") if out.exists() else None
    write_text(out, text, overwrite=True)
    try:
        count = len(Robot.load(out).skins)
    except Exception:
        if before is None:
            out.unlink()
        else:
            write_text(out, before, overwrite=True)
        raise
    typer.echo(
        f"{out}: {given['name']} on {link}, {count} skins in all; next: tomoskin live --robot {out}"
    )


def _from(file: str, out: Path) -> str:
    """A file by its path from the folder of the robot file."""
    return path.relpath(file, out.parent)


def _name_of(link: str) -> str:
    """A link's name as that of a skin."""
    name = "".join(c if c.isascii() and c.isalnum() else "_" for c in link.lower())
    return (name if name[:1].isalpha() else f"skin_{name}")[:32]


def _pose(urdf: Any, link: str, at: str | None, *, on_mesh: bool) -> dict[str, list[str]]:
    """Keys of the skin's section that say where it lies."""
    from tomoskin.core import SkinError
    from tomoskin.model.robot import pose_numbers

    if on_mesh:
        if at is not None:
            raise typer.BadParameter("--at and --on-mesh cannot be combined", param_hint="--at")
        if link not in urdf.meshes:
            raise SkinError(
                f'link "{link}" has no mesh', where=urdf.source, hint="give the pose with --at"
            )
        numbers = [*(1e3 * urdf.meshes[link].position), *urdf.meshes[link].degrees()]
    else:
        try:
            numbers = [*pose_numbers(at or "", "mm and degrees")]
        except ValueError as error:
            raise typer.BadParameter(str(error), param_hint="--at") from None
    position, angles = ([f"{x:.6g}" for x in part] for part in (numbers[:3], numbers[3:]))
    return {"position": [f"{x} mm" for x in position], "angles": [f"{x} deg" for x in angles]}
