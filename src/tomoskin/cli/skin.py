"""``tomoskin skin``: the built-in skins, skin files checked, made for a body."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from tomoskin.cli.app import group
from tomoskin.cli.named_files import SKIN, ForceFlag, Reads, Writes
from tomoskin.cli.options import SkinArgument
from tomoskin.cli.output import JsonFlag, remark, tell
from tomoskin.cli.skin_figures import alpha
from tomoskin.core import DIMENSIONS, DataError, SkinError, no_such, write_text

if TYPE_CHECKING:
    from tomoskin.core import FloatArray
    from tomoskin.model.skin import Skin


app = group("skin")
app.command("alpha")(alpha)


@app.command("list")
def list_skins(json: JsonFlag = False) -> None:
    """List the built-in skins with their descriptions."""
    from tomoskin.model.skin import Skin

    skins = [Skin.load(name) for name in Skin.names()]
    lines = (f"{s.name:<18} {s.n_electrodes:>3} electrodes  {s.description}" for s in skins)
    tell([_summary(skin) for skin in skins], lines, json=json)


@app.command()
def show(name: SkinArgument, json: JsonFlag = False) -> None:
    """Print the skin file of a skin."""
    from tomoskin.model.skin import Skin

    skin = Skin.load(name)
    text = skin.to_toml()
    tell(_summary(skin) | {"toml": text}, [text.rstrip("\n")], json=json)


@app.command()
def check(file: SkinArgument, json: JsonFlag = False) -> None:
    """Check a skin file, mesh it, and compare the expected voltages with the board's limits."""
    from tomoskin.model.mesh import quality
    from tomoskin.model.skin import Skin, regions_doubt
    from tomoskin.pipeline import ambiguity_of
    from tomoskin.sensing.signal import Headroom

    skin = Skin.load(file)
    mesh = quality(skin.mesh())
    headroom = Headroom.of_skin(skin)
    if headroom.problem is not None:
        raise SkinError(headroom.problem, where=skin.source)
    if (doubt := regions_doubt(skin.inverse, skin.touch)) is not None:
        remark(f"{skin.source}: {doubt}")
    if (ambiguity := ambiguity_of(skin)) is not None:
        remark(f"{skin.source}: {ambiguity.text}")
    figures = {
        "n_cells": mesh.n_cells,
        "n_points": mesh.n_points,
        "quality_minimum": mesh.minimum,
        "quality_mean": mesh.mean,
    }
    line = (
        f"{skin.name}: ok; {skin.n_electrodes} electrodes, {skin.pattern().n_meas} measurements, "
        f"{mesh.n_cells} triangles of quality {mesh.minimum:.2f} (least), {mesh.mean:.2f} (mean)"
    )
    document = {"ok": True, "mesh": figures, "headroom": headroom.figures()}
    document["ambiguity"] = None if ambiguity is None else ambiguity.text
    tell(_summary(skin) | document, [line, f"expected: {headroom.text}"], json=json)


@app.command()
def lay(
    surface: Annotated[Path, typer.Argument(help="A .stl, .obj, .ply or .dae file."), Reads()],
    electrodes: Annotated[
        Path,
        typer.Option(
            metavar="CSV",
            help="Text file with x,y,z of each electrode, E1 first, in the unit of SURFACE.",
        ),
        Reads(),
    ],
    out: Annotated[
        Path, typer.Option(metavar="X.toml", help="File for the new skin."), Writes(SKIN)
    ],
    unit: Annotated[str, typer.Option(help="Unit of SURFACE: mm, cm or m.")] = "mm",
    like: Annotated[
        str, typer.Option(metavar="SKIN", help="Skin whose material, contacts and drive are used.")
    ] = "textile-disc-16",
    force: ForceFlag = False,
) -> None:
    """Write the skin file of a sheet on a scanned or drawn surface."""
    from tomoskin.model.skin import Skin, lay as laid

    if unit not in ("mm", "cm", "m"):
        raise DataError(no_such(unit, ("mm", "cm", "m")), where="--unit")
    skin = laid(surface, _positions(electrodes), unit=unit, like=Skin.load(like), source=str(out))
    mesh = skin.mesh()
    write_text(out, skin.to_toml(), overwrite=force)
    scale = DIMENSIONS["length"]["cm"]
    typer.echo(
        f"{out}: {skin.n_electrodes} electrodes on {mesh.volumes.sum() / scale**2:.4g} cm², "
        f"{len(mesh.cells)} triangles"
    )


def _summary(skin: Skin) -> dict[str, Any]:
    return {
        "name": skin.name,
        "description": skin.description,
        "source": str(skin.source),
        "identity": skin.identity,
        "n_electrodes": skin.n_electrodes,
        "n_measurements": skin.pattern().n_meas,
    }


def _positions(path: Path) -> FloatArray:
    """(n, 3) numbers of a CSV file, which may have a heading."""
    import numpy as np

    from tomoskin.model.skin import read_text

    rows = []
    for number, line in enumerate(read_text(path, "a table of positions").splitlines(), 1):
        fields = [field.strip() for field in line.split(",")]
        if line.strip() and not (number == 1 and fields[:3] == ["x", "y", "z"]):
            rows.append(_numbers(fields, f"{path}, line {number}"))
    if not rows:
        raise DataError("expected lines x,y,z, got an empty file", where=str(path))
    return np.array(rows)


def _numbers(fields: list[str], where: str) -> list[float]:
    try:
        x, y, z = map(float, fields)
    except ValueError:
        raise DataError(
            f'expected three numbers x,y,z, got "{",".join(fields)}"',
            where=where,
            hint="use decimal points, with commas between the numbers",
        ) from None
    return [x, y, z]
