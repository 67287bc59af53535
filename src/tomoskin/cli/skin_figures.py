"""``tomoskin skin alpha``: what each rule would choose, and the curves that it reads."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from tomoskin.cli.named_files import FIGURE, ForceFlag, Reads, Writes
from tomoskin.cli.named_parts import Recorded, frame_range
from tomoskin.cli.options import FramesOption, ReferenceOption, SkinArgument
from tomoskin.cli.output import JsonFlag, tell
from tomoskin.core import TomoskinError, no_such

if TYPE_CHECKING:
    from collections.abc import Iterator

    from tomoskin.core import FloatArray
    from tomoskin.imaging import AlphaChoice, Spectrum
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
