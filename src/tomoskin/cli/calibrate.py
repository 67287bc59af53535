"""``tomoskin calibrate KIND``: learn from labelled examples, one command for every kind.

A kind is a function of what was recorded and of the options that it alone has; :func:`_kind` makes
its command, with the options that all kinds share.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable
from dataclasses import dataclass, field
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, get_type_hints

import numpy as np
import typer

from tomoskin.cli import calibrate_labels as labels, calibrate_reports as reports
from tomoskin.cli.app import group
from tomoskin.cli.named_files import SKIN, ForceFlag, Reads, Writes, with_options
from tomoskin.cli.named_parts import Recorded, labelled_frames, reconstructed
from tomoskin.cli.options import CalibrationOut, KnownSkinOption, ReferenceOption, SkinOption
from tomoskin.cli.output import Bar, JsonFlag, remark, tell
from tomoskin.core import DataError, FloatArray, write_text

if TYPE_CHECKING:
    from tomoskin.core import IntArray
    from tomoskin.learning import Locator
    from tomoskin.pipeline import Reconstruction

app = group("calibrate")


@dataclass(frozen=True)
class LearningOutcome:
    """What came of it: ``write`` makes the file, ``facts`` and ``lines`` say it to programs and to
    people; a ``problem`` is raised at the end."""

    write: Callable[..., None] | None
    facts: dict[str, Any]
    lines: list[str] = field(default_factory=list)
    problem: DataError | None = None


Learn = Callable[..., LearningOutcome]


def _kind(
    name: str, about: str, skin: Any = SkinOption, out: Any = CalibrationOut
) -> Callable[[Learn], Learn]:
    """Make a function the command ``name``, whose input is ``about`` something; a decorator.

    Its first parameter is what was recorded, the others are its own options.
    """

    def register(learn: Learn) -> Learn:
        def command(
            recording: Path,
            out: Path,
            skin: str | None,
            reference: str | None,
            force: bool,
            json: bool,
            **own: Any,
        ) -> None:
            outcome = learn(Recorded.of(recording, skin, reference, needs_skin=needs_skin), **own)
            if outcome.write is not None:
                outcome.write(out, overwrite=force)
            tell(outcome.facts, outcome.lines, json=json)
            if outcome.problem is not None:
                raise outcome.problem

        needs_skin = skin is SkinOption
        hints, needed = get_type_hints(learn, include_extras=True), inspect.Parameter.empty
        own = list(inspect.signature(learn).parameters.values())[1:]
        argument = Annotated[Path, typer.Argument(metavar="INPUT", help=about), Reads()]
        options = {
            "recording": (argument, needed),
            "out": (out, needed),
            "skin": (skin, None),
            **{one.name: (hints[one.name], one.default) for one in own},
            "reference": (ReferenceOption, None),
            "force": (ForceFlag, False),
            "json": (JsonFlag, False),
        }
        app.command(name)(with_options(command, learn, options))
        return learn

    return register


_TOUCHED = "Frames with labels, one touch in each."


@_kind("touch", _TOUCHED, KnownSkinOption)
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
    unlabelled: Annotated[
        bool,
        typer.Option(
            "--unlabelled",
            help="With --onto: frames without a label are touches too, all over the skin. They "
            "align the old calibration to today, and labels are optional.",
        ),
    ] = False,
) -> LearningOutcome:
    """Learn where a touch is from presses at known positions."""
    from tomoskin.learning import TOUCH, Locator, label_doubts

    if unlabelled and not onto:
        raise DataError(
            "--unlabelled aligns an older calibration, but none is given",
            hint="add --onto OLD.npz",
        )
    old = TOUCH.read(onto) if onto else None
    given = labelled.onto(old)
    dv, xy = given.dv, given.labels if unlabelled else given.xy
    frames = np.arange(len(dv)) if unlabelled else labelled_frames(xy)
    dv, xy = dv[frames], xy[frames]
    if old is None:
        with Bar("learning") as bar:
            locator = Locator.fit(dv, xy, pattern=given.pattern, skin=given.skin, progress=bar)
        calibration = TOUCH.of(locator, given.pattern, given.skin)
    elif unlabelled:
        calibration = old.with_model(_aligned(old.model, dv, xy))
    else:
        with Bar("learning") as bar:
            calibration = old.with_model(old.model.updated(dv, xy, progress=bar))
    added = _added(calibration.model, frames, dv, xy)
    older = old.model if old is not None and not unlabelled else None
    facts = reports.touch_facts(calibration.model, added, older)
    if given.skin is not None and (doubts := label_doubts(calibration.model, given.skin)):
        remark(f"{given.path}: {doubts}")
    if facts["is_guess"]:
        remark(
            f"{given.path}: the data hardly depend on the position. Presses left out have a mean "
            f"error of {facts['mean_mm']:.0f} mm, and of {facts['guessed_mm']:.0f} mm if the "
            "answer is always their middle. Check --reference and the labels, or press harder"
        )
    return LearningOutcome(calibration.write, facts, reports.touch_lines(facts))


def _aligned(locator: Locator, dv: FloatArray, xy: FloatArray) -> Locator:
    """The locator for the session of these frames; what has changed is said."""
    from tomoskin.learning import SessionAlignment

    alignment = SessionAlignment.of(locator, dv, xy)
    if not alignment.holds:
        raise DataError("; ".join(alignment.findings))
    for finding in alignment.findings:
        remark(finding)
    with Bar("learning") as bar:
        return locator.aligned(alignment, bar)


def _added(locator: Locator, frames: IntArray, dv: FloatArray, xy: FloatArray) -> list[int]:
    """Frames that are the locator's last presses: all, or after an alignment the labelled ones."""
    presses = locator.presses.dv
    for some in (np.arange(len(dv)), labelled_frames(xy)):
        if len(some) and np.array_equal(presses[-len(some) :], dv[some], equal_nan=True):
            return list(frames[some].tolist())
    return []


def _reconstruction(labelled: Recorded) -> Reconstruction:
    """The touches that the pipeline finds in each frame."""
    from tomoskin.pipeline import prepare

    with Bar("preparing"):
        prepared = prepare(labelled.drawn)
    with Bar("finding touches") as bar:
        return reconstructed(labelled, prepared, None, bar)


@_kind("rub", _TOUCHED)
def rub(labelled: Recorded) -> LearningOutcome:
    """Learn where a touch is from one finger that rubs the whole skin, without labels.

    The skin file says where the electrodes are. Five frames with a label improve the result.
    """
    from tomoskin.learning import TOUCH, Rubbing

    dv, skin, frames = labelled.dv, labelled.drawn, np.arange(len(labelled.dv))
    if labelled.noise is not None:
        result = _reconstruction(labelled)
        frames = result.frames[[len(touches) == 1 for touches in result.touches]]
    xy = None if labelled.data.labels is None else labelled.data.labels[frames]
    with Bar("learning") as bar:
        rubbing = Rubbing.of(dv[frames], skin, xy)
        if not rubbing.holds:
            raise DataError("; ".join(rubbing.findings), where=str(labelled.path))
        locator = rubbing.locator(bar).sliding(labelled.data.time[frames], dv[frames])
    for finding in rubbing.findings:
        remark(finding)
    lag = 1e3 * (locator.presses.slide_lag or 0.0)
    facts = {
        "touched_frames": len(frames),
        "used": len(rubbing.presses),
        "labelled": rubbing.labelled,
        "deviation_mm": 1e3 * rubbing.deviation,
        "alike": rubbing.alike,
        "slide_lag_mm": lag,
    }
    lines = [f"{len(frames)} frames with a touch, {rubbing.text}"]
    if lag:
        lines.append(f"the sheet lags {lag:.0f} mm behind a finger that slides: this is corrected")
    made = TOUCH.of(locator, labelled.pattern, skin)
    return LearningOutcome(made.write, facts, lines)


Unit = StrEnum("Unit", {"N": "N", "G": "g", "KG": "kg"})
"""Units in which labels of force are given."""

Length = StrEnum("Length", {"UM": "um", "MM": "mm", "CM": "cm", "M": "m"})
"""Units in which labels of depth are given."""


@_kind("force", "Frames; some have a label with their force.")
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


@_kind("depth", "Frames; some have a label with the depth of their press.")
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
    from tomoskin.learning import MEASURED, AmountModel, calibration_kinds, report_of

    skin, path, of = labelled.drawn, labelled.path, MEASURED[name]
    amount = labels.amounts(path, len(labelled.recording), given, unit, of)
    result = _reconstruction(labelled)
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


@_kind("class", "Frames; some have a label with their class.", KnownSkinOption)
def classes(
    labelled: Recorded,
    label: Annotated[
        list[str] | None,
        typer.Option(
            "--class",
            metavar="NAME=A:B",
            help="Label: frames A to B-1 show this class. Can be repeated. Default: class or "
            "flags of the file.",
        ),
    ] = None,
    onto: Annotated[
        Path | None,
        typer.Option(
            metavar="OLD.npz",
            help="Calibration of another session. These frames, labelled or not, align it to "
            "this one.",
        ),
        Reads(),
    ] = None,
) -> LearningOutcome:
    """Learn the class of a frame, or flags, from a few examples of each."""
    from tomoskin.learning import CLASSES, Classifier

    with Bar("learning from the older calibration"):
        old = CLASSES.read(onto) if onto else None
    given = labelled.onto(old)
    codes = old.model.examples.codes if old else None
    examples = labels.class_examples(given.path, given.dv, label, codes)
    with Bar("learning"):
        if old is None:
            skin_id = given.skin.identity if given.skin else ""
            made = CLASSES.of(Classifier.learn(examples, skin_id), given.pattern, given.skin)
        else:
            made = old.with_model(old.model.in_session(examples.dv, examples.flags))
    facts = reports.class_facts(made.model, len(given.dv))
    return LearningOutcome(
        made.write, facts, reports.class_lines(made.model, facts, is_aligned=old is not None)
    )


@_kind("body", "A recorded motion of the body, without touches.")
def body(
    labelled: Recorded,
    bend: Annotated[
        list[str] | None,
        typer.Option(
            metavar="DEG[@AXIS]=A:B",
            help="Label: frames A to B-1 are bent by this angle about an axis in this direction "
            f"from x (default {labels.ALONG_Y:.0f}). Can be repeated. Default: the session's own "
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
    from tomoskin.learning import BODY, BodyModel
    from tomoskin.pipeline import prepare, voltage_covariance

    skin, rest = labelled.drawn, labelled.rest
    if rest is None:
        raise DataError(
            "expected voltages with untouched frames, got none", where=str(labelled.path)
        )
    with Bar("preparing"):
        prepared = prepare(skin)
    examples = labels.body_examples(labelled.path, labelled.data, rest.mean, bend, states)
    with Bar("learning"):
        model = BodyModel.learn(examples, voltage_covariance(prepared, rest))
    for problem in model.doubts():
        remark(f"{labelled.path}: {problem}")
    facts = reports.body_facts(model)
    made = BODY.of(model, labelled.pattern, skin)
    return LearningOutcome(made.write, facts, reports.body_lines(model, facts))


_MappedOut = Annotated[
    Path,
    typer.Option(
        metavar="MAPPED.toml", help="New skin file with the channel mapping that was found."
    ),
    Writes(SKIN),
]


@_kind("mapping", _TOUCHED, out=_MappedOut)
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
