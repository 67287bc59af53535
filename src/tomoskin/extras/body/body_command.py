"""``tomoskin calibrate body``: learn a motion, and say what came of it."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np
import typer

from tomoskin.cli import Bar, LearningOutcome, Reads, Recorded, calibration_command, remark
from tomoskin.core import DataError
from tomoskin.extras.body.labels import ALONG_Y, body_examples

if TYPE_CHECKING:
    from tomoskin.extras.body.body_model import BodyModel


@calibration_command("A recorded motion of the body, without touches.")
def body(
    labelled: Recorded,
    bend: Annotated[
        list[str] | None,
        typer.Option(
            metavar="DEG[@AXIS]=A:B",
            help="Label: frames A to B-1 are bent by this angle about an axis in this direction "
            f"from x (default {ALONG_Y:.0f}). Can be repeated. Default: the session's own "
            "truth.",
        ),
    ] = None,
    states: Annotated[
        Path | None,
        typer.Option(
            metavar="TABLE.csv",
            help="Encoder values: columns frame and one to three coordinates, as angle_deg, "
            "stretch.",
        ),
        Reads(),
    ] = None,
) -> LearningOutcome:
    """Learn how a body moves under the skin: touches are then separated from it, and its state
    estimated.

    Without angles or encoder values the state has no unit.
    """
    from tomoskin.extras.body.body_model import BodyModel
    from tomoskin.extras.body.body_reader import BODY
    from tomoskin.pipeline import prepare, voltage_covariance

    skin, rest = labelled.drawn, labelled.rest
    if rest is None:
        raise DataError(
            "expected voltages with untouched frames, got none", where=str(labelled.path)
        )
    with Bar("preparing"):
        prepared = prepare(skin)
    examples = body_examples(labelled.path, labelled.data, rest.mean, bend, states)
    with Bar("learning"):
        model = BodyModel.learn(examples, voltage_covariance(prepared, rest))
    for problem in model.doubts():
        remark(f"{labelled.path}: {problem}")
    facts = _facts(model)
    made = BODY.of(model, labelled.pattern, skin)
    return LearningOutcome(made.write, facts, _lines(model, facts))


def _facts(model: BodyModel) -> dict[str, Any]:
    """Coordinates of the body, and by how much left-out states are missed."""
    return {
        "frames": len(model.body.time),
        "directions": model.n_modes,
        "errors": dict(zip(model.body.names, model.error.tolist(), strict=True)),
        "remembers": model.remembers,
    }


def _lines(model: BodyModel, facts: dict[str, Any]) -> list[str]:
    """What :func:`_facts` gave, in sentences."""
    errors = ", ".join(
        f"{name} {np.degrees(error):.2f}°" if name.startswith("angle") else f"{name} {error:.3g}"
        for name, error in facts["errors"].items()
    )
    lines = [
        f"{facts['frames']} frames, {facts['directions']} directions; in cross-validation "
        f"the RMS errors of the state are: {errors}"
    ]
    if model.remembers:
        lines.append("the sheet's memory is part of the calibration: process frames in their order")
    if not model.examples.names:
        lines.append("nothing measured the state, so it has no unit: --states TABLE.csv gives one")
    elif not model.body.turns and "angle" in model.body.names:
        lines.append(
            "the axis of a bend is estimated from three directions on; here the given axis is used"
        )
    return lines
