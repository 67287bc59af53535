"""``tomoskin calibrate force``: learn newtons from presses with known weights."""

from __future__ import annotations

from dataclasses import asdict
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np
import typer

from tomoskin.cli.frame_ranges import labels_of_frames
from tomoskin.cli.named_files import ForceFlag, Reads
from tomoskin.cli.options import CalibrationOut, ReferenceOption, SkinOption
from tomoskin.cli.output import Bar, JsonFlag, emit, remark
from tomoskin.cli.recording import reconstructed, say_notes
from tomoskin.core import DataError, FloatArray

if TYPE_CHECKING:
    from collections.abc import Sequence

    from tomoskin.core import Detection, Touch
    from tomoskin.learning import ForceReport, WeighedPresses
    from tomoskin.pipeline import Reconstruction


class Unit(StrEnum):
    """The unit of the labels."""

    N = "N"
    G = "g"
    KG = "kg"


def calibrate_force(
    recording: Annotated[
        Path,
        typer.Argument(metavar="INPUT", help="Frames; some have a label with their force."),
        Reads(),
    ],
    out: CalibrationOut,
    skin: SkinOption = None,
    weight: Annotated[
        list[str] | None,
        typer.Option(
            metavar="FORCE=A:B",
            help="Label: this weight pressed in frames A to B-1. Can be repeated. Default: "
            "force_n of the file.",
        ),
    ] = None,
    unit: Annotated[Unit, typer.Option(help="Unit of the forces.")] = Unit.N,
    reference: ReferenceOption = None,
    force: ForceFlag = False,
    json: JsonFlag = False,
) -> None:
    """Learn the force of touches from presses with known weights, all by the same tip."""
    from tomoskin.cli.choices import skin_for_file
    from tomoskin.files.imports import read_recording
    from tomoskin.learning import FORCE, NEWTONS, ForceModel, ForceReport
    from tomoskin.pipeline import prepare

    chosen = skin_for_file(skin, recording)
    data = read_recording(recording)
    newtons = NEWTONS[unit.value] * _labels(recording, len(data), weight or [])
    with Bar("preparing"):
        prepared = prepare(chosen)
    data = data.in_order_of(prepared.pattern)
    say_notes(data)
    with Bar("finding touches") as bar:
        result = reconstructed(data, prepared, reference, None, bar)
    presses = _weighed(recording, result, newtons, data.time)
    with Bar("learning"):
        model = ForceModel.fit(presses, chosen)
    FORCE.of(model, prepared.pattern, chosen).write(out, overwrite=force)
    report = ForceReport.of(model)
    if json:
        emit(_findings(report))
    else:
        _say(report)


def _labels(path: Path, n: int, given: Sequence[str]) -> FloatArray:
    """(n,) force in each frame, in the unit that it is given in; NaN without one."""
    from tomoskin.core import load_arrays, real_numbers
    from tomoskin.files.imports import is_session

    if given:
        return np.array(
            [
                _number(text) if text else np.nan
                for text in labels_of_frames(given, n, "--weight", "FORCE")
            ]
        )
    arrays = {} if is_session(path) or path.suffix.lower() != ".npz" else load_arrays(path)
    if "force_n" not in arrays:
        raise DataError(
            "holds no forces: expected force_n (n_frames,), NaN where no weight was applied",
            where=str(path),
            hint="add force_n, or --weight 4.9=40:60 --weight 9.8=80:100",
        )
    labels = real_numbers(arrays, "force_n", str(path))
    if labels.shape != (n,):
        raise DataError(f"expected {n} values of force_n, got {labels.shape}", where=str(path))
    return labels


def _number(text: str) -> float:
    try:
        number = float(text)
    except ValueError:
        number = np.nan
    if not np.isfinite(number):
        raise typer.BadParameter(f'expected a number as FORCE, got "{text}"', param_hint="--weight")
    return number


def _weighed(
    path: Path, result: Reconstruction, newtons: FloatArray, time: FloatArray
) -> WeighedPresses:
    """Touches of frames with one touch; a press is what one does at one spot until it is lifted."""
    from tomoskin.learning import WeighedPresses

    rows: list[tuple[Detection, float, int, float]] = []
    without, several, number = 0, 0, 0
    before: Touch | None = None
    for frame, touches in zip(result.frames.tolist(), result.touches, strict=True):
        known = bool(np.isfinite(newtons[frame]))
        without += known and not touches
        several += known and len(touches) > 1
        alone = touches[0] if len(touches) == 1 else None
        if alone is not None:
            number += before is None or not _goes_on(before, alone)
            rows.append((alone.detection, float(newtons[frame]), number, float(time[frame])))
        before = alone
    if without or several:
        remark(
            f"{path}: of the frames with a force, {without} show no touch and {several} show "
            "several touches; these were left out"
        )
    detections, *labels = zip(*rows, strict=True) if rows else ((), (), (), ())
    return WeighedPresses.of(detections, *(np.array(column) for column in labels))


def _goes_on(before: Touch, touch: Touch) -> bool:
    """Whether it is the press of the frame before: the same touch within its own radius."""
    was, now = before.detection, touch.detection
    apart = np.hypot(now.x - was.x, now.y - was.y)
    return before.id == touch.id and bool(apart**2 <= now.area / np.pi)


def _findings(report: ForceReport) -> dict[str, Any]:
    facts = asdict(report)
    return {**facts, "held_by_90_percent_intervals": facts.pop("held")}


def _say(report: ForceReport) -> None:
    typer.echo(report.text)
    typer.echo(
        "forces are valid for the tip that pressed: a tip of another size changes the sheet "
        "differently"
    )
    for doubtful in report.remarks:
        who = "" if doubtful.press is None else f"press {doubtful.press:>4}  uncertain: "
        typer.echo(f"{who}{doubtful.reason}")
