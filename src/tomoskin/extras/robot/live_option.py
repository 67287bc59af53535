"""``tomoskin live --robot``: all skins of a robot on one page."""

from __future__ import annotations

import contextlib
import itertools
import re
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from tomoskin.cli import Bar, Reads, remark

if TYPE_CHECKING:
    from tomoskin.cli import Served
    from tomoskin.extras.robot.robot_file import Robot
    from tomoskin.extras.robot.robot_run import RobotRun


@dataclass(frozen=True)
class RobotOption:
    """Several skins in place of one."""

    robot: Annotated[
        Path | None,
        typer.Option(
            metavar="ROBOT.toml",
            help="Robot file: run all its skins, instead of --skin and --source. Or repeat these "
            "for several skins, with a name for each: --skin NAME=SKIN.",
        ),
        Reads(),
    ] = None

    def instead(
        self, skins: list[str], sources: list[str], calibrations: list[Path]
    ) -> Callable[[list[str] | None, Served, bool], None] | None:
        """What runs the skins of the robot; None where one skin runs alone."""
        several = chosen_robot(self.robot, skins, sources, calibrations)
        if several is None:
            return None
        return lambda sinks, served, early: _run_robot(several, sinks, served, early=early)


_NAMED = re.compile(r"[^=./\\]+=.+")
"""A skin with its name on the robot; not a path that has "=" in it, such as ./a=b.toml."""


def chosen_robot(
    file: Path | None, skins: list[str], sources: list[str], calibrations: list[Path]
) -> Robot | None:
    """That of a robot file, or of ``--skin NAME=SKIN``; None where one skin runs alone."""
    from tomoskin.extras.robot.robot_file import Robot

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
    from tomoskin.cli import chosen_sinks, skin_for_source
    from tomoskin.extras.robot.robot_run import Member, RobotRun, with_joints

    robot = with_joints(robot)
    with Bar("preparing"):
        members = [
            Member.of(skin, skin_for_source(skin.skin, skin.source), chosen_sinks(sinks))
            for skin in robot.skins
        ]
    for member in members:
        if (problem := member.prepared.headroom.problem) is not None:
            remark(f"{member.place.name}: {problem}")
    run = RobotRun(members, early=early)
    stopped = _serve_robot(robot, run, served)
    facts = {
        name: {"frames": s.frames, "p50_ms": 1e3 * s.p50, "p99_ms": 1e3 * s.p99}
        for name, s in run.statuses().items()
    }
    served.end({"skins": facts}, stopped)


def _serve_robot(robot: Robot, run: RobotRun, served: Served) -> list[str]:
    """Until a signal comes; why recordings have ended by themselves."""
    from tomoskin.cli import hub_of, troubles_told
    from tomoskin.extras.robot.overview import Overview, robot_application

    ended: list[list[str]] = []
    with served.listening() as (listener, policy), contextlib.ExitStack() as stack:
        for skin, runner in run.runners.items():
            ended.append(stack.enter_context(troubles_told(runner, f"{skin}: ")))
        stack.callback(run.stop)
        run.start()
        if served.record is not None:
            run.record(served.record)
        overview = Overview(robot, run, served.folder)
        hubs = {s.name: hub_of(run.runners[s.name], s.source, served.folder) for s in robot.skins}
        app = robot_application(overview, hubs, policy)
        served.serve(app, listener, policy, f"{len(robot.skins)} skins of {robot.name} are live")
    return list(itertools.chain(*ended))
