"""``tomoskin calibrate KIND``: learn from labelled examples, one command for every kind.

A kind is a function of what was recorded and of the options that it alone has; what all kinds share
is in :mod:`tomoskin.cli.learning_command`.
"""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import numpy as np
import typer

from tomoskin.cli import calibrate_labels as labels, calibrate_reports as reports
from tomoskin.cli.app import group
from tomoskin.cli.learning_command import LearningOutcome, calibration_command
from tomoskin.cli.named_files import SKIN, Added, Reads, Writes
from tomoskin.cli.named_parts import Recorded, found_touches, labelled_frames
from tomoskin.cli.options import KnownSkinOption
from tomoskin.cli.output import Bar, remark
from tomoskin.core import DataError, FloatArray, write_text

if TYPE_CHECKING:
    from tomoskin.core import IntArray
    from tomoskin.learning import Calibration, FitTrial, Locator

app = group("calibrate")


TOUCHED = "Frames with labels, one touch in each."
"""What learns from touches is given."""


@app.command("touch")
@calibration_command(TOUCHED, KnownSkinOption)
def touch(
    labelled: Recorded,
    onto: Annotated[
        Path | None,
        typer.Option(
            metavar="OLD.npz",
            help="Older calibration that these presses extend: ten or twenty presses align it to "
            "today.",
        ),
        Reads(),
    ] = None,
    *,
    added: Added,
) -> LearningOutcome:
    """Learn where a touch is from presses at known positions."""
    from tomoskin.learning import TOUCH, label_doubts

    old = TOUCH.read(onto) if onto else None
    given, older = labelled.onto(old), None
    aligned = next(filter(None, (one.aligned(given, old) for one in added)), None)
    trial = None
    if aligned is not None:
        calibration, dv, xy = aligned, given.dv, given.labels
        frames = np.arange(len(dv))
    else:
        dv, xy, frames = _presses(given)
        calibration = _learnt(given, old, dv, xy)
        older = None if old is None else old.model
        trial = _trial(given, calibration.model)
    newest = _newest(calibration.model, frames, dv, xy)
    facts = reports.touch_facts(calibration.model, newest, older)
    if given.skin is not None and (doubts := label_doubts(calibration.model, given.skin)):
        remark(f"{given.path}: {doubts}")
    if facts["is_guess"]:
        remark(
            f"{given.path}: the data hardly depend on the position. Presses left out have a mean "
            f"error of {facts['mean_mm']:.0f} mm, and of {facts['guessed_mm']:.0f} mm if the "
            "answer is always their middle. Check --reference and the labels, or press harder"
        )
    if trial is not None and trial.text:
        facts["with_calibration_mm"] = 1e3 * trial.together
        facts["fit_alone_mm"], facts["is_used"] = 1e3 * trial.alone, trial.helps
    lines = [*reports.touch_lines(facts), *([trial.text] if trial and trial.text else ())]
    return LearningOutcome(calibration.write, facts, lines)


def _presses(given: Recorded) -> tuple[FloatArray, FloatArray, IntArray]:
    """(n, n_meas) V, (n, 2) m and first frame of each labelled press. Frames of a course in time
    that follow each other with the same label are one press."""
    from tomoskin.learning import HeldPresses

    if given.data.timed:
        held = HeldPresses.of(given.dv, given.xy)
        return held.dv, held.xy, held.frames
    frames = labelled_frames(given.xy)
    return given.dv[frames], given.xy[frames], frames


def _trial(given: Recorded, locator: Locator) -> FitTrial | None:
    """The calibration beside the fit of touches, where the file tells how the skin reads untouched;
    None where nothing is fitted."""
    from tomoskin.learning import FitTrial
    from tomoskin.pipeline import fit_conditions, prepare

    if given.skin is None or given.rest is None:
        return None
    with Bar("preparing"):
        prepared = prepare(given.skin)
    if prepared.pattern.identity != given.pattern.identity:
        return None
    return FitTrial.of(locator, fit_conditions(prepared, given.rest))


def _learnt(
    given: Recorded, old: Calibration[Locator] | None, dv: FloatArray, xy: FloatArray
) -> Calibration[Locator]:
    """A calibration of presses, beside those of the ``old`` one where there is one."""
    from tomoskin.learning import TOUCH, Locator

    with Bar("learning") as bar:
        if old is not None:
            return old.with_model(old.model.updated(dv, xy, progress=bar))
        locator = Locator.fit(dv, xy, pattern=given.pattern, skin=given.skin, progress=bar)
    return TOUCH.of(locator, given.pattern, given.skin)


def _newest(locator: Locator, frames: IntArray, dv: FloatArray, xy: FloatArray) -> list[int]:
    """Frames that are the locator's last presses: all, or after an alignment the labelled ones."""
    presses = locator.presses.dv
    for some in (np.arange(len(dv)), labelled_frames(xy)):
        if len(some) and np.array_equal(presses[-len(some) :], dv[some], equal_nan=True):
            return list(frames[some].tolist())
    return []


Unit = StrEnum("Unit", {"N": "N", "G": "g", "KG": "kg"})
"""Units in which labels of force are given."""

Length = StrEnum("Length", {"UM": "um", "MM": "mm", "CM": "cm", "IN": "in", "M": "m"})
"""Units in which labels of depth are given."""


@app.command("force")
@calibration_command("Frames; some have a label with their force.")
def force(
    labelled: Recorded,
    weight: Annotated[
        list[str] | None,
        typer.Option(
            metavar="FORCE=A:B",
            help="Label: this weight pressed in frames A to B-1. Can be repeated. Default: "
            "force_n of the file.",
        ),
    ] = None,
    unit: Annotated[Unit, typer.Option(help="Unit of the forces.")] = Unit.N,
) -> LearningOutcome:
    """Learn the force of touches from presses with known weights, all by the same tip."""
    return _amount(
        labelled,
        "force",
        weight,
        unit,
        "forces are valid for the tip that pressed: a tip of another size changes the sheet "
        "differently",
    )


@app.command("depth")
@calibration_command("Frames; some have a label with the depth of their press.")
def depth(
    labelled: Recorded,
    depth: Annotated[
        list[str] | None,
        typer.Option(
            metavar="DEPTH=A:B",
            help="Label: in frames A to B-1 the tip stood so deep below the untouched sheet. Can "
            "be repeated. Default: depth_m of the file.",
        ),
    ] = None,
    unit: Annotated[
        Length | None,
        typer.Option(help="Unit of the depths. Default: mm of --depth, m of the file's."),
    ] = None,
) -> LearningOutcome:
    """Learn the depth of touches from presses of known depth, by tips such as will press later."""
    return _amount(
        labelled,
        "depth",
        depth,
        unit,
        "depths are valid for tips like those that pressed: a small deep one looks like a large "
        "shallow one, and intervals hold what the taught tips differ by",
    )


def _amount(
    labelled: Recorded, name: str, given: list[str] | None, unit: str | None, advice: str
) -> LearningOutcome:
    from tomoskin.learning import (
        MEASURED,
        AmountModel,
        calibration_kinds,
        label_unit_doubt,
        report_of,
    )

    skin, path, of = labelled.drawn, labelled.path, MEASURED[name]
    amount = labels.amounts(path, len(labelled.recording), given, unit, of)
    if (doubt := label_unit_doubt(of, amount)) is not None:
        remark(f"{path}: {doubt}")
    result = found_touches(labelled)
    presses = labels.labelled_presses(path, result, amount, labelled.data.time, of)
    with Bar("learning"):
        model = AmountModel.fit(presses, skin)
    facts = report_of(model)
    lines = [facts.pop("text"), advice]
    for doubtful in model.remarks:
        who = "" if doubtful.press is None else f"press {doubtful.press:>4}  uncertain: "
        lines.append(f"{who}{doubtful.reason}")
    kind = next(kind for kind in calibration_kinds() if kind.name == name)
    return LearningOutcome(kind.of(model, labelled.pattern, skin).write, facts, lines)


_MappedOut = Annotated[
    Path,
    typer.Option(
        metavar="MAPPED.toml", help="New skin file with the channel mapping that was found."
    ),
    Writes(SKIN),
]


@app.command("mapping")
@calibration_command(TOUCHED, out=_MappedOut)
def mapping(labelled: Recorded) -> LearningOutcome:
    """Find rotation, mirroring, swapped wires and polarity from some presses.

    The result is a skin file whose electrodes are where the wires end. Give it as --skin to any
    other command.
    """
    from tomoskin.learning import solve_channel_mapping

    xy, dv, rest = labelled.xy, labelled.dv, labelled.rest
    frames, skin = labelled_frames(xy), labelled.drawn
    with Bar("comparing channel mappings") as bar:
        answer = solve_channel_mapping(
            dv[frames], xy[frames], skin, reference=None if rest is None else rest.mean,
            noise=labelled.noise, progress=bar,
        )  # fmt: skip
    facts = reports.mapping_facts(answer, skin, frames.tolist())
    lines = reports.mapping_lines(facts)
    if answer.sure:
        document = answer.mapping.applied(skin).to_toml()

        def write(out: Path, *, overwrite: bool) -> None:
            write_text(out, document, overwrite=overwrite)

        return LearningOutcome(write, facts, lines)
    x, y = facts["next_press_mm"]
    hint = f"a further press is most useful at x {x:+.0f} mm, y {y:+.0f} mm"
    problem = DataError(answer.reason, where=str(labelled.path), hint=hint)
    return LearningOutcome(None, facts, lines, problem)
