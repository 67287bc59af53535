"""``tomoskin skin place``: a skin laid on a link of a robot."""

from __future__ import annotations

from os import path
from pathlib import Path
from typing import Annotated, Any

import typer

from tomoskin.cli import DEFAULT_SKIN, NamedSkinOption, Otherwise, Reads
from tomoskin.core import SkinError, write_text


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
    from tomoskin.extras.robot.robot_file import Robot, add_skin
    from tomoskin.extras.robot.urdf import Urdf
    from tomoskin.model.skin import Skin

    robot = Urdf.read(urdf)
    robot.check_link(link, "LINK")
    Skin.load(skin)
    earlier = Robot.load(out).skins if out.exists() else ()
    given: dict[str, Any] = {
        "name": name or _name_of(link),
        "skin": _from(skin, out) if skin.endswith(".toml") else skin,
        "source": source or f"twin:seed={len(earlier) + 1}",
        "link": link,
    } | _pose(robot, link, at, on_mesh=on_mesh)
    write_text(out, add_skin(out, given, _from(str(urdf), out)), overwrite=True)
    typer.echo(
        f"{out}: {given['name']} on {link}, {len(earlier) + 1} skins in all; "
        f"next: tomoskin live --robot {out}"
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
    from tomoskin.model.mesh import pose_numbers

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
