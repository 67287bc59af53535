"""``tomoskin skin alpha``: what each rule would choose, and the curves that it reads."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from tomoskin.cli.named_files import FIGURE, ForceFlag, Reads, Writes
from tomoskin.cli.options import FramesOption, ReferenceOption, SkinArgument
from tomoskin.cli.output import JsonFlag, emit
from tomoskin.cli.recording import frame_range, idle_frames
from tomoskin.core import TomoskinError

if TYPE_CHECKING:
    from tomoskin.inverse import AlphaChoice, Evidence, Spectrum
    from tomoskin.pipeline import Prepared

Outcome = tuple[str, "AlphaChoice | TomoskinError"]
"""A rule, and what it chose or why it could not."""


def alpha(
    skin: SkinArgument,
    recording: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Frames that the rules may look at."),
        Reads(),
    ] = None,
    reference: ReferenceOption = None,
    frames: FramesOption = None,
    rule: Annotated[str | None, typer.Option(help="Only this rule.")] = None,
    out: Annotated[
        Path | None,
        typer.Option(metavar="X.png", help="Where the curves are drawn."),
        Writes(FIGURE),
    ] = None,
    force: ForceFlag = False,
    json: JsonFlag = False,
) -> None:
    """Show what each rule chooses for alpha; with a recording, by its noise, frames and labels."""
    from tomoskin.inverse import RULES, Spectrum
    from tomoskin.pipeline import prepare
    from tomoskin.skin import Skin

    prepared = prepare(Skin.load(skin))
    prepared, evidence = _evidence(prepared, recording, reference, frames)
    spectrum = Spectrum.of(prepared.problem)
    outcomes = [(name, _outcome(spectrum, name, evidence)) for name in ([rule] if rule else RULES)]
    if rule and isinstance(outcomes[0][1], TomoskinError):
        raise outcomes[0][1]
    if out is not None:
        _draw(out, prepared, spectrum, outcomes, evidence, overwrite=force)
    _report(prepared, spectrum, outcomes, json=json)


def _evidence(
    prepared: Prepared, recording: Path | None, reference: str | None, frames: str | None
) -> tuple[Prepared, Evidence]:
    """What the recording tells, and the skin without the rows that are dead in it.

    Without a recording: the noise that the read-out predicts.
    """
    from tomoskin.formats import read_recording
    from tomoskin.inverse import Evidence
    from tomoskin.pipeline import changes_of

    if recording is None:
        return prepared, Evidence(noise=prepared.predicted_noise())
    whole = read_recording(recording).in_order_of(prepared.pattern)
    idle = idle_frames(whole, reference, prepared.pattern)
    changes = changes_of(prepared, whole.part(*frame_range(whole, frames)), idle)
    return changes.prepared, changes.evidence()


def _outcome(spectrum: Spectrum, rule: str, evidence: Evidence) -> AlphaChoice | TomoskinError:
    from tomoskin.inverse import choose

    try:
        return choose(spectrum, rule, evidence)
    except TomoskinError as error:
        return error


def _draw(
    out: Path,
    prepared: Prepared,
    spectrum: Spectrum,
    outcomes: list[Outcome],
    evidence: Evidence,
    *,
    overwrite: bool,
) -> None:
    from tomoskin.formats import write_choices
    from tomoskin.inverse import AlphaChoice, picard

    choices = [found for _, found in outcomes if isinstance(found, AlphaChoice)]
    told = None
    if evidence.frames is not None:
        told = picard(spectrum, evidence.frames, evidence.noise)
    title = f"alpha of {prepared.skin.name}"
    write_choices(out, title, choices, told, overwrite=overwrite)


def _report(prepared: Prepared, spectrum: Spectrum, outcomes: list[Outcome], *, json: bool) -> None:
    if json:
        emit(
            {
                "skin": prepared.skin.name,
                "alpha": prepared.choice.alpha,
                "rule": prepared.choice.rule,
                "condition": spectrum.condition,
                "rules": {name: _row(found) for name, found in outcomes},
            }
        )
        return
    in_use = prepared.choice
    typer.echo(f"{prepared.skin.name}: alpha {in_use.alpha:.4g} by {in_use.rule}, {in_use.reason}")
    typer.echo(
        f"{len(spectrum.singular_values)} singular values from {spectrum.singular_values[0]:.3g}, "
        f"condition {spectrum.condition:.3g}"
    )
    for name, found in outcomes:
        value = "-" if isinstance(found, TomoskinError) else f"{found.alpha:.4g}"
        said = found.message if isinstance(found, TomoskinError) else found.reason
        typer.echo(f"{name:<13} {value:>9}  {said}")


def _row(found: AlphaChoice | TomoskinError) -> dict[str, Any]:
    if isinstance(found, TomoskinError):
        return {"alpha": None, "reason": str(found)}
    return {"alpha": found.alpha, "reason": found.reason}
