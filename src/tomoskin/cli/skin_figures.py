"""``tomoskin skin alpha`` and ``merit``: what each rule would choose, and the curves that it reads;
the figures of merit of a skin's operator."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from tomoskin.cli.named_files import FIGURE, TABLE, ForceFlag, Reads, Writes
from tomoskin.cli.named_parts import Recorded, frame_range
from tomoskin.cli.options import FramesOption, ReferenceOption, SkinArgument
from tomoskin.cli.output import Bar, JsonFlag, tell
from tomoskin.core import TomoskinError, no_such

if TYPE_CHECKING:
    from collections.abc import Iterator

    from tomoskin.core import FloatArray
    from tomoskin.imaging import AlphaChoice, Merit, Spectrum
    from tomoskin.model.forward import ForwardModel
    from tomoskin.pipeline import Prepared

Outcome = tuple[str, "AlphaChoice | TomoskinError"]
"""A rule, and what it chose or why it could not."""


def alpha(
    skin: SkinArgument,
    recording: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Frames that tell the noise."),
        Reads(),
    ] = None,
    reference: ReferenceOption = None,
    frames: FramesOption = None,
    rule: Annotated[str | None, typer.Option(help="Show this criterion only.")] = None,
    out: Annotated[
        Path | None,
        typer.Option(metavar="X.png", help="File for the picture of the curves."),
        Writes(FIGURE),
    ] = None,
    force: ForceFlag = False,
    json: JsonFlag = False,
) -> None:
    """Show what each criterion chooses for alpha; with a recording, by its noise; and draw
    the Picard plot of its frames."""
    from tomoskin.files.exports import write_choices
    from tomoskin.imaging import RULES, AlphaChoice, Spectrum, picard
    from tomoskin.model.skin import Skin
    from tomoskin.pipeline import prepare, recorded_frames

    if rule is not None and rule not in RULES:
        raise typer.BadParameter(no_such(rule, RULES, "a rule"), param_hint="--rule")
    prepared = prepare(Skin.load(skin))
    given = None if recording is None else Recorded.of(recording, skin, reference)
    noise: FloatArray | None = prepared.predicted_noise()
    changes = None
    if given is not None:
        some = given.data.part(*frame_range(given.data, frames))
        changes = recorded_frames(prepared, some, given.idle)
        prepared, noise = changes.prepared, changes.noise
    spectrum = Spectrum.of(prepared.problem)
    outcomes = [(name, _outcome(spectrum, name, noise)) for name in ([rule] if rule else RULES)]
    if rule and isinstance(outcomes[0][1], TomoskinError):
        raise outcomes[0][1]
    if out is not None:
        predicted = None
        if changes is not None:
            whole = changes.differences[~changes.missing.any(axis=1)]
            predicted = picard(spectrum, whole, noise)
        choices = [choice for _, choice in outcomes if isinstance(choice, AlphaChoice)]
        title = f"alpha of {prepared.skin.name}"
        write_choices(out, title, choices, predicted, overwrite=force)
    document = {
        "skin": prepared.skin.name,
        "alpha": prepared.choice.alpha,
        "rule": prepared.choice.rule,
        "condition": spectrum.condition,
        "rules": {name: _row(choice) for name, choice in outcomes},
    }
    tell(document, _rule_lines(prepared, spectrum, outcomes), json=json)


def _outcome(
    spectrum: Spectrum, rule: str, noise: FloatArray | None
) -> AlphaChoice | TomoskinError:
    from tomoskin.imaging import choose

    try:
        return choose(spectrum, rule, noise)
    except TomoskinError as error:
        return error


def _rule_lines(prepared: Prepared, spectrum: Spectrum, outcomes: list[Outcome]) -> Iterator[str]:
    in_use, values = prepared.choice, spectrum.singular_values
    yield f"{prepared.skin.name}: alpha {in_use.alpha:.4g} by {in_use.rule}, {in_use.reason}"
    yield f"{len(values)} singular values from {values[0]:.3g}, condition {spectrum.condition:.3g}"
    for name, choice in outcomes:
        if isinstance(choice, TomoskinError):
            yield f"{name:<13} {'-':>9}  {choice.message}"
        else:
            yield f"{name:<13} {choice.alpha:>9.4g}  {choice.reason}"


def _row(choice: AlphaChoice | TomoskinError) -> dict[str, Any]:
    if isinstance(choice, TomoskinError):
        return {"alpha": None, "reason": str(choice)}
    return {"alpha": choice.alpha, "reason": choice.reason}


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
    from tomoskin.files.exports import write_merit, write_merit_table
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
    from tomoskin.imaging import Greit, Targets, along, figures

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
