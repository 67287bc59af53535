"""``tomoskin skin merit``: the figures of merit of a skin's operator."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from tomoskin.cli import (
    FIGURE,
    TABLE,
    Bar,
    ForceFlag,
    JsonFlag,
    SkinArgument,
    Writes,
    tell,
)

if TYPE_CHECKING:
    from collections.abc import Iterator

    from tomoskin.extras.greit.merit import Merit
    from tomoskin.model.forward import ForwardModel
    from tomoskin.pipeline import Prepared

_FINER = 4
"""Targets are simulated on a mesh of so many times the cells."""

_TARGETS, _REACH, _SIZE = 10, 0.9, 0.025
"""Number of targets, how far out they go, and their radius as a part of the sheet's extent."""

_FIGURES = ("amplitude", "position_error", "offset", "resolution", "deformation", "ringing")


def merit(
    skin: SkinArgument,
    towards: Annotated[
        int,
        typer.Option(min=1, metavar="N", help="Targets lie between the centre and EN."),
    ] = 1,
    greit: Annotated[
        float | None,
        typer.Option(metavar="FIGURE", help="Also show a GREIT operator of this noise figure."),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option(metavar="X.png|.csv", help="File for the curves or the table."),
        Writes(FIGURE | TABLE),
    ] = None,
    force: ForceFlag = False,
    json: JsonFlag = False,
) -> None:
    """Show GREIT's figures of merit and the noise figure of a skin's operator."""
    from tomoskin.extras.greit.merit_curves import write_merit, write_merit_table
    from tomoskin.model.skin import Skin
    from tomoskin.pipeline import prepare

    with Bar("computing the figures of merit"):
        figures = _figures(prepare(Skin.load(skin)), towards, greit)
    if out is not None:
        write = write_merit_table if out.suffix.lower() in TABLE else write_merit
        write(out, figures, overwrite=force)
    document = {
        operator: {"noise_figure": merit.noise_figure, "distance_m": merit.distance.tolist()}
        | {name: getattr(merit, name).tolist() for name in _FIGURES}
        for operator, merit in figures.items()
    }
    tell(document, _merit_lines(figures), json=json)


def _figures(prepared: Prepared, towards: int, figure: float | None) -> dict[str, Merit]:
    """Figures by the name of the operator."""
    from tomoskin.extras.greit.merit import Targets, along, figures
    from tomoskin.extras.greit.trainer import Greit

    skin, operator = prepared.skin, prepared.operator
    if towards > skin.n_electrodes:
        raise typer.BadParameter(
            f"expected an electrode from 1 (E1) to {skin.n_electrodes}, got {towards}",
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
    merits = {skin.inverse.prior: figures(operator, targets, noise)}
    if figure is not None:
        trained = Greit(
            prepared.model,
            simulated_on=fine,
            conductivity=skin.conductivity,
            difference=operator.difference,
            noise=noise,
            noise_figure=figure,
        )
        merits["greit"] = figures(trained, targets, noise)
    return merits


def _finer(prepared: Prepared) -> ForwardModel:
    from tomoskin.model.forward import ForwardModel

    skin = prepared.skin
    mesh = skin.altered({"mesh": {"cells": _FINER * len(prepared.mesh.cells)}}).mesh()
    return ForwardModel(
        mesh, prepared.pattern, skin.contact_impedance, skin.polarity * skin.current
    )


def _merit_lines(figures: dict[str, Merit]) -> Iterator[str]:
    for operator, merit in figures.items():
        yield f"{operator}: noise figure {merit.noise_figure:.3g}"
        yield "centre mm  amplitude  inwards mm  off mm  resolution  deformation  ringing"
        table = (merit.distance, *(getattr(merit, name) for name in _FIGURES))
        for r, ar, pe, off, res, sd, rng in zip(*table, strict=True):
            yield (
                f"{1e3 * r:9.1f}  {ar:9.2f}  {1e3 * pe:+10.1f}  {1e3 * off:6.1f}"
                f"  {res:10.3f}  {sd:11.3f}  {rng:7.3f}"
            )
