"""``tomoskin skin``: the built-in skins, and whether a skin file can be meant."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any

import typer

from tomoskin.cli.alpha import alpha
from tomoskin.cli.contents import group
from tomoskin.cli.lay import lay
from tomoskin.cli.merit import merit
from tomoskin.cli.output import JsonFlag, emit

if TYPE_CHECKING:
    from tomoskin.mesh import Quality
    from tomoskin.skin import Skin

app = group("List, show, check and lay skins.")
app.command("alpha")(alpha)
app.command("merit")(merit)
app.command("lay")(lay)

_Name = Annotated[str, typer.Argument(metavar="SKIN", help="Built-in name or path.")]


@app.command("list")
def list_skins(json: JsonFlag = False) -> None:
    """List the built-in skins."""
    from tomoskin.skin import Skin

    skins = [Skin.load(name) for name in Skin.names()]
    if json:
        emit([_summary(skin) for skin in skins])
        return
    for skin in skins:
        typer.echo(f"{skin.name:<18} {skin.n_electrodes:>3} electrodes  {skin.description}")


@app.command()
def show(name: _Name, json: JsonFlag = False) -> None:
    """Show a skin as the file that would make it."""
    from tomoskin.skin import Skin

    skin = Skin.load(name)
    if json:
        emit(_summary(skin) | {"toml": skin.to_toml()})
    else:
        typer.echo(skin.to_toml().rstrip("\n"))


@app.command()
def check(file: _Name, json: JsonFlag = False) -> None:
    """Check a skin file, and mesh it."""
    from tomoskin.mesh import quality
    from tomoskin.skin import Skin

    skin = Skin.load(file)
    found = quality(skin.mesh())
    if json:
        emit(_summary(skin) | {"ok": True, "mesh": _mesh(found)})
        return
    typer.echo(
        f"{skin.name}: ok; {skin.n_electrodes} electrodes, {skin.pattern().n_meas} measurements, "
        f"{found.n_cells} triangles of quality {found.minimum:.2f} (least), {found.mean:.2f} (mean)"
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


def _mesh(found: Quality) -> dict[str, Any]:
    return {
        "n_cells": found.n_cells,
        "n_points": found.n_points,
        "quality_minimum": found.minimum,
        "quality_mean": found.mean,
    }
