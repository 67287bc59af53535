"""``tomoskin skin merit``: what images of a skin are worth, before it is built."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from tomoskin.cli.named_files import FIGURE, TABLE, ForceFlag, Writes
from tomoskin.cli.options import SkinArgument
from tomoskin.cli.output import JsonFlag, emit
from tomoskin.cli.progress import Bar

if TYPE_CHECKING:
    from tomoskin.forward import ForwardModel
    from tomoskin.inverse import Merit
    from tomoskin.pipeline import Prepared

_FINER = 4
"""Targets are simulated on a mesh of so many times the cells."""

_TARGETS, _REACH, _SIZE = 10, 0.9, 0.025
"""Number of targets, how far out they go, and their radius as a part of the sheet's extent."""


def merit(
    skin: SkinArgument,
    towards: Annotated[
        int, typer.Option(min=1, metavar="N", help="Targets lie from the centre to electrode N.")
    ] = 1,
    greit: Annotated[
        float | None,
        typer.Option(metavar="FIGURE", help="Also a GREIT operator of that noise figure."),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option(metavar="X.png|.csv", help="Where curves or table go."),
        Writes(FIGURE | TABLE),
    ] = None,
    force: ForceFlag = False,
    json: JsonFlag = False,
) -> None:
    """Show GREIT's figures of merit and the noise figure of a skin's operator."""
    from tomoskin.pipeline import prepare
    from tomoskin.skin import Skin

    with Bar("working out figures"):
        found = _found(prepare(Skin.load(skin)), towards, greit)
    if out is not None:
        _write(out, found, overwrite=force)
    _report(found, json=json)


def _found(prepared: Prepared, towards: int, figure: float | None) -> dict[str, Merit]:
    """Figures by the name of the operator."""
    from tomoskin.inverse import Greit, Targets, along, figures

    skin, operator = prepared.skin, prepared.operator
    if towards > skin.n_electrodes:
        raise typer.BadParameter(
            f"expected an electrode from 1 to {skin.n_electrodes}, got {towards}",
            param_hint="--towards",
        )
    fine = _finer(prepared)
    line = along(prepared.mesh, skin.electrode_centres[towards - 1], _TARGETS)
    low, high = prepared.mesh.points.min(axis=0), prepared.mesh.points.max(axis=0)
    targets = Targets.simulate(
        fine,
        line[0] + _REACH * (line - line[0]),
        radius=_SIZE * float((high - low).max()),
        conductivity=skin.conductivity,
        difference=operator.difference,
    )
    noise = prepared.predicted_noise()
    found = {skin.inverse.prior: figures(operator, targets, noise)}
    if figure is not None:
        trained = Greit(
            prepared.model,
            simulated_on=fine,
            conductivity=skin.conductivity,
            difference=operator.difference,
            noise=noise,
            noise_figure=figure,
        )
        found["greit"] = figures(trained, targets, noise)
    return found


def _finer(prepared: Prepared) -> ForwardModel:
    from tomoskin.forward import ForwardModel

    skin = prepared.skin
    mesh = skin.altered({"mesh": {"cells": _FINER * len(prepared.mesh.cells)}}).mesh()
    return ForwardModel(
        mesh, prepared.pattern, skin.contact_impedance, skin.polarity * skin.current
    )


def _write(out: Path, found: dict[str, Merit], *, overwrite: bool) -> None:
    from tomoskin.formats import write_merit, write_merit_table

    write = write_merit_table if out.suffix.lower() in TABLE else write_merit
    write(out, found, overwrite=overwrite)


def _report(found: dict[str, Merit], *, json: bool) -> None:
    names = ("amplitude", "position_error", "offset", "resolution", "deformation", "ringing")
    if json:
        emit(
            {
                operator: {"noise_figure": m.noise_figure, "distance_m": m.distance.tolist()}
                | {name: getattr(m, name).tolist() for name in names}
                for operator, m in found.items()
            }
        )
        return
    for operator, m in found.items():
        typer.echo(f"{operator}: noise figure {m.noise_figure:.3g}")
        typer.echo("centre mm  amplitude  inwards mm  off mm  resolution  deformation  ringing")
        table = (m.distance, *(getattr(m, name) for name in names))
        for r, ar, pe, off, res, sd, rng in zip(*table, strict=True):
            typer.echo(
                f"{1e3 * r:9.1f}  {ar:9.2f}  {1e3 * pe:+10.1f}  {1e3 * off:6.1f}"
                f"  {res:10.3f}  {sd:11.3f}  {rng:7.3f}"
            )
