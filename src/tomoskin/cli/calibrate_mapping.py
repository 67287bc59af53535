"""``tomoskin calibrate mapping``: which wire ends at which electrode."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from tomoskin.cli.choices import skin_for_file
from tomoskin.cli.named_files import SKIN, ForceFlag, Writes
from tomoskin.cli.options import LabelledArgument, ReferenceOption, SkinOption
from tomoskin.cli.output import Bar, JsonFlag, emit
from tomoskin.cli.recording import changes, idle_frames, labelled_frames, labels, say_notes
from tomoskin.core import DataError

if TYPE_CHECKING:
    from tomoskin.core import FloatArray
    from tomoskin.learning import MappingAnswer
    from tomoskin.model.pattern import Pattern
    from tomoskin.model.skin import Skin
    from tomoskin.sensing.signal import Recording


def calibrate_mapping(
    recording: LabelledArgument,
    out: Annotated[
        Path,
        typer.Option(
            metavar="MAPPED.toml", help="New skin file with the channel mapping that was found."
        ),
        Writes(SKIN),
    ],
    skin: SkinOption = None,
    reference: ReferenceOption = None,
    force: ForceFlag = False,
    json: JsonFlag = False,
) -> None:
    """Find rotation, mirroring, swapped wires and polarity from some presses.

    The result is a skin file whose electrodes are where the wires end. Give it as --skin to any
    other command.
    """
    from tomoskin.core import write_text
    from tomoskin.files.imports import read_recording
    from tomoskin.learning import solve_channel_mapping

    data = read_recording(recording)
    say_notes(data)
    drawn = skin_for_file(skin, recording)
    pattern = drawn.pattern()
    data = data.in_order_of(pattern)
    xy, dv = labels(data), changes(data, reference, pattern)
    frames = labelled_frames(xy)
    rest, noise = _at_rest(data, reference, pattern)
    with Bar("comparing channel mappings") as bar:
        answer = solve_channel_mapping(
            dv[frames], xy[frames], drawn, reference=rest, noise=noise, progress=bar
        )
    facts = _findings(answer, drawn, frames.tolist())
    if answer.sure:
        write_text(out, answer.mapping.applied(drawn).to_toml(), overwrite=force)
    if json:
        emit(facts)
    else:
        _say(facts)
    if not answer.sure:
        raise DataError(_why(answer), where=str(recording), hint=_next(facts))


def _at_rest(
    data: Recording, reference: str | None, pattern: Pattern
) -> tuple[FloatArray | None, FloatArray | None]:
    """Mean and noise (n_meas,) V of the untouched skin, as far as they are known."""
    from tomoskin.sensing.signal import Reference

    idle = idle_frames(data, reference, pattern)
    if idle is None or isinstance(idle, str):
        return None, None
    idle_level = Reference.of(idle.real.astype(float))
    usable = idle_level.noise_is_known and (idle_level.noise > 0).all()
    return idle_level.mean, idle_level.noise if usable else None


def _findings(answer: MappingAnswer, skin: Skin, frames: list[int]) -> dict[str, Any]:
    from tomoskin.learning import ring_of

    ring = ring_of(skin)
    return {
        "presses": len(frames),
        "sure": answer.sure,
        "mapping": answer.mapping.text(ring),
        "places": list(answer.mapping.electrodes),
        "polarity": _polarity(answer),
        "probability": answer.probability,
        "runner_up": answer.runner_up.text(ring),
        "odds": min(answer.odds, 1e300),
        "unexplained": answer.unexplained,
        "next_press_mm": (1e3 * answer.next_place).tolist(),
        "remarks": [
            {"frame": frames[row], "looks_like_mm": [1e3 * x, 1e3 * y]}
            for row, x, y in answer.contradicted
        ],
    }


def _polarity(answer: MappingAnswer) -> str:
    if not answer.polarity_known:
        return "not known"
    return "reversed" if answer.mapping.reversed else "normal"


def _say(facts: dict[str, Any]) -> None:
    typer.echo(f"{facts['presses']} presses: {facts['mapping']}")
    typer.echo(
        f"probability {facts['probability']:.3f}; {min(facts['odds'], 1e6):.3g} times as likely as "
        f"the next: {facts['runner_up']}"
    )
    if facts["polarity"] == "not known":
        typer.echo(
            "the polarity is not known: give untouched frames, or set [touch] sign in the skin file"
        )
    for remark in facts["remarks"]:
        x, y = remark["looks_like_mm"]
        typer.echo(
            f"frame {remark['frame']:>4}  uncertain: fits a press at x {x:+.0f} mm, y "
            f"{y:+.0f} mm better"
        )


def _why(answer: MappingAnswer) -> str:
    if answer.doubtful:
        return "too many of these presses fit other positions better: check the labels"
    if answer.unexplained > 1 - answer.probability - answer.unexplained:
        return "no channel mapping explains these presses well enough"
    return (
        "these presses do not decide it: the most likely channel mapping has a probability of "
        f"{answer.probability:.2f}"
    )


def _next(facts: dict[str, Any]) -> str:
    x, y = facts["next_press_mm"]
    return f"a further press is most useful at x {x:+.0f} mm, y {y:+.0f} mm"
