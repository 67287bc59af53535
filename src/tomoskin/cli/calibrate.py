"""``tomoskin calibrate``: learn from labelled presses."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from tomoskin.cli.app import group
from tomoskin.cli.calibrate_bend import calibrate_bend
from tomoskin.cli.calibrate_class import calibrate_class
from tomoskin.cli.calibrate_force import calibrate_force
from tomoskin.cli.calibrate_mapping import calibrate_mapping
from tomoskin.cli.calibrate_rub import calibrate_rub
from tomoskin.cli.named_files import ForceFlag, Reads
from tomoskin.cli.options import CalibrationOut, KnownSkinOption, LabelledArgument, ReferenceOption
from tomoskin.cli.output import Bar, JsonFlag, emit, remark
from tomoskin.cli.recording import changes, labelled_frames, labels, say_notes

if TYPE_CHECKING:
    from tomoskin.core import FloatArray
    from tomoskin.learning import Calibration, Locator
    from tomoskin.model.pattern import Pattern
    from tomoskin.model.skin import Skin
    from tomoskin.sensing.signal import Recording

    Learn = Callable[[FloatArray, FloatArray], Calibration[Locator]]

app = group("calibrate")

_SHOWN = 10
_DRIFTED = 2.0


app.command("bend")(calibrate_bend)
app.command("force")(calibrate_force)
app.command("rub")(calibrate_rub)
app.command("class")(calibrate_class)
app.command("mapping")(calibrate_mapping)


@app.command("touch")
def touch(
    recording: LabelledArgument,
    out: CalibrationOut,
    skin: KnownSkinOption = None,
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
    reference: ReferenceOption = None,
    force: ForceFlag = False,
    json: JsonFlag = False,
) -> None:
    """Learn where a touch is from presses at known positions."""
    import numpy as np

    from tomoskin.core import DataError
    from tomoskin.files.imports import read_recording

    data = read_recording(recording)
    say_notes(data)
    if unlabelled and not onto:
        raise DataError(
            "--unlabelled aligns an older calibration, but none is given",
            hint="add --onto OLD.npz",
        )
    learn, pattern = (
        _onto(onto, skin, recording, aligns=unlabelled)
        if onto
        else _from_skin(*_what_of(skin, recording, data))
    )
    data = data.in_order_of(pattern)
    dv = changes(data, reference, pattern)
    xy = _labels_if_any(data) if unlabelled else labels(data)
    frames = np.arange(len(dv)) if unlabelled else labelled_frames(xy)
    calibration = learn(dv[frames], xy[frames])
    calibration.write(out, overwrite=force)
    known = calibration.model.presses.dv  # of an alignment, all frames, labelled ones or none
    added = (
        some.tolist()
        for some in (frames, labelled_frames(xy))
        if len(some) and np.array_equal(known[-len(some) :], dv[some], equal_nan=True)
    )
    facts = _findings(calibration, next(added, []))
    if facts["is_guess"]:
        remark(
            f"{recording}: the data hardly depend on the position. Presses left out have a mean "
            f"error of {facts['mean_mm']:.0f} mm, and of {facts['guessed_mm']:.0f} mm if the "
            "answer is always their middle. Check --reference and the labels, or press harder"
        )
    if json:
        emit(facts)
    else:
        _say(facts)


def _from_skin(skin: Skin | None, pattern: Pattern) -> tuple[Learn, Pattern]:
    """What learns from these presses alone."""
    from tomoskin.learning import TOUCH, Locator

    def learn(dv: FloatArray, xy: FloatArray) -> Calibration[Locator]:
        with Bar("learning") as bar:
            locator = Locator.fit(dv, xy, pattern=pattern, skin=skin, progress=bar)
        return TOUCH.of(locator, pattern, skin)

    return learn, pattern


def _labels_if_any(data: Recording) -> FloatArray:
    """(n_frames, 2) m, rows of NaN where there is no label."""
    import numpy as np

    return np.full((len(data.time), 2), np.nan) if data.labels is None else data.labels


def _onto(path: Path, name: str | None, recording: Path, *, aligns: bool) -> tuple[Learn, Pattern]:
    """What learns from these presses and an older calibration of the same skin.

    It ``aligns`` that one to frames of which few have a label, or adds labelled presses to its own.
    """
    from tomoskin.cli.choices import skin_if_any
    from tomoskin.learning import TOUCH

    old = TOUCH.read(path)
    if (skin := skin_if_any(name, recording)) is not None:
        old.check_skin(skin)

    def learn(dv: FloatArray, xy: FloatArray) -> Calibration[Locator]:
        with Bar("learning") as bar:
            return old.with_model(old.model.updated(dv, xy, progress=bar))

    def align(dv: FloatArray, xy: FloatArray) -> Calibration[Locator]:
        return old.with_model(_aligned(old.model, dv, xy))

    return (align if aligns else learn), old.pattern


def _aligned(locator: Locator, dv: FloatArray, xy: FloatArray) -> Locator:
    """The locator for the session of these frames; what has changed is said."""
    from tomoskin.core import DataError
    from tomoskin.learning import SessionAlignment

    alignment = SessionAlignment.of(locator, dv, xy)
    if not alignment.holds:
        raise DataError("; ".join(alignment.findings))
    for finding in alignment.findings:
        remark(finding)
    with Bar("learning") as bar:
        return locator.aligned(alignment, bar)


def _what_of(name: str | None, path: Path, data: Recording) -> tuple[Skin | None, Pattern]:
    """The skin, where there is one, and the table of rows."""
    from tomoskin.cli.choices import skin_if_any
    from tomoskin.model.pattern import Pattern

    skin = skin_if_any(name, path)
    return skin, skin.pattern() if skin else Pattern.from_tables(data.drive, data.measure)


def _findings(calibration: Calibration[Locator], frames: list[int]) -> dict[str, Any]:
    import numpy as np

    from tomoskin.learning import LeftOut

    locator, left_out = calibration.model, LeftOut.of(calibration.model)
    older = len(locator.presses) - len(frames)
    errors = 1e3 * locator.errors
    x, y = (1e3 * locator.next_place()).tolist()
    return {
        "presses": len(locator.presses),
        "mean_mm": float(errors.mean()),
        "median_mm": float(np.median(errors)),
        "p95_mm": float(np.percentile(errors, 95)),
        "guessed_mm": 1e3 * left_out.guessed,
        "is_guess": left_out.is_guess,
        "held_by_90_percent_ellipses": locator.held,
        "one_force": left_out.one_force,
        "drift": left_out.drift,
        "next_press_mm": [x, y],
        "remarks": [
            {"frame": frames[r.row - older] if r.row >= older else None, "reason": r.reason}
            for r in locator.remarks
        ],
    }


def _say(facts: dict[str, Any]) -> None:
    typer.echo(
        f"{facts['presses']} presses; each press left out in turn, the mean error is "
        f"{facts['mean_mm']:.1f} mm (median {facts['median_mm']:.1f}, 95 % "
        f"{facts['p95_mm']:.1f}), and {100 * facts['held_by_90_percent_ellipses']:.0f} % lie "
        "within their 90 % ellipses"
    )
    if facts["one_force"]:
        typer.echo(
            "all presses were about equally hard: softer and harder ones have larger errors; add "
            "some of both with --onto"
        )
    for doubtful in facts["remarks"][:_SHOWN]:
        frame = doubtful["frame"]
        who = "an older press" if frame is None else f"frame {frame:>4}"
        typer.echo(f"{who}  uncertain: {doubtful['reason']}")
    if len(facts["remarks"]) > _SHOWN:
        typer.echo(f"… and {len(facts['remarks']) - _SHOWN} more: --json lists all")
    if facts["drift"] > _DRIFTED:
        typer.echo(
            f"the errors of the last presses are {facts['drift']:.1f} times as large as usual: "
            "the skin has changed; press it again"
        )
    x, y = facts["next_press_mm"]
    typer.echo(f"the next press is most useful at x {x:+.0f} mm, y {y:+.0f} mm")
