"""``tomoskin session export --robot``: whose skins they were."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from tomoskin.cli import Reads

if TYPE_CHECKING:
    from tomoskin.files.exports import Export


@dataclass(frozen=True)
class WornOption:
    """The robot that wore the skins of a recording."""

    robot: Annotated[
        Path | None,
        typer.Option(
            metavar="robot.toml",
            help="The robot that wore the skins: formats for robots say where its links were. "
            "They and --touches mark touches by the robot itself, or leave them out as it does.",
        ),
        Reads(),
    ] = None

    def check(self, out: Path, touches: Path | None) -> None:
        """Raise BadParameter where nothing that is written says where links were."""
        from tomoskin.files.exports import export_formats

        formats = export_formats()
        if self.robot is None or touches is not None or formats[out.suffix.lower()].of_links:
            return
        *some, last = ["--touches", *(f"X{end}" for end, one in formats.items() if one.of_links)]
        partners = " or ".join(filter(None, (", ".join(some), last)))
        raise typer.BadParameter(
            f"expected it together with {partners}, got {out}", param_hint="--robot"
        )

    def applied(self, job: Export) -> Export:
        """The export, which knows where the skins were."""
        from tomoskin.extras.robot.robot_file import Robot
        from tomoskin.extras.robot.robot_run import with_joints

        if self.robot is None:
            return job
        return replace(job, robot=with_joints(Robot.load(self.robot)))
