"""``tomoskin skin lay``: a skin file for the surface of a body."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from tomoskin.cli.named_files import SKIN, ForceFlag, Reads, Writes

if TYPE_CHECKING:
    from tomoskin.core import FloatArray


def lay(
    surface: Annotated[Path, typer.Argument(help="A .stl, .obj or .ply file."), Reads()],
    electrodes: Annotated[
        Path,
        typer.Option(metavar="CSV", help="x,y,z of each electrode, E1 first, in the file's unit."),
        Reads(),
    ],
    out: Annotated[
        Path, typer.Option(metavar="X.toml", help="Where the skin file goes."), Writes(SKIN)
    ],
    unit: Annotated[str, typer.Option(help="Of the file: mm, cm or m.")] = "mm",
    like: Annotated[
        str, typer.Option(metavar="SKIN", help="Skin to take material, contacts and drive from.")
    ] = "textile-disc-16",
    force: ForceFlag = False,
) -> None:
    """Write the skin file of a sheet on a scanned or drawn surface."""
    from tomoskin.core import DIMENSIONS, DataError, write_text
    from tomoskin.skin import Skin
    from tomoskin.skin import lay as laid

    if unit not in ("mm", "cm", "m"):
        raise DataError(f'expected mm, cm or m, got "{unit}"', where="--unit")
    skin = laid(surface, _places(electrodes), unit=unit, like=Skin.load(like), source=str(out))
    mesh = skin.mesh()
    write_text(out, skin.to_toml(), overwrite=force)
    scale = DIMENSIONS["length"]["cm"]
    typer.echo(
        f"{out}: {skin.n_electrodes} electrodes on {mesh.volumes.sum() / scale**2:.4g} cm², "
        f"{len(mesh.cells)} triangles"
    )


def _places(path: Path) -> FloatArray:
    """(n, 3) numbers of a CSV file, which may have a heading."""
    import numpy as np

    from tomoskin.core import DataError

    try:
        lines = path.read_text(encoding="utf-8-sig").splitlines()
    except (OSError, UnicodeDecodeError) as error:
        raise DataError(f"cannot be read: {error}", where=str(path)) from None
    rows = []
    for number, line in enumerate(lines, 1):
        fields = [field.strip() for field in line.split(",")]
        if line.strip() and not (number == 1 and fields[:3] == ["x", "y", "z"]):
            rows.append(_numbers(fields, f"{path}, line {number}"))
    if not rows:
        raise DataError("expected lines x,y,z, got none", where=str(path))
    return np.array(rows)


def _numbers(fields: list[str], where: str) -> list[float]:
    from tomoskin.core import DataError

    try:
        x, y, z = map(float, fields)
    except ValueError:
        raise DataError(
            f'expected three numbers x,y,z, got "{",".join(fields)}"',
            where=where,
            hint="decimal points, commas between",
        ) from None
    return [x, y, z]
