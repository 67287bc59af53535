"""``tomoskin classify``: which class each frame shows, by a calibration."""

from __future__ import annotations

from itertools import groupby
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from tomoskin.cli import (
    TABLE,
    Bar,
    ForceFlag,
    JsonFlag,
    Reads,
    Recorded,
    RecordingArgument,
    ReferenceOption,
    SameSkinOption,
    Writes,
    say_scale,
    tell,
)
from tomoskin.core import write_rows

if TYPE_CHECKING:
    from collections.abc import Iterator

    from tomoskin.extras.classes.classifier import Answers
    from tomoskin.sensing.signal import Recording

_SHOWN = 20
"""Changes of class that are printed."""


def classify(
    recording: RecordingArgument,
    calibration: Annotated[
        Path, typer.Option(metavar="C.npz", help="File from tomoskin calibrate class."), Reads()
    ],
    out: Annotated[
        Path | None,
        typer.Option(metavar="X.csv", help="File for the table."),
        Writes(TABLE),
    ] = None,
    force: ForceFlag = False,
    skin: SameSkinOption = None,
    reference: ReferenceOption = None,
    ask: Annotated[
        int,
        typer.Option(min=0, metavar="N", help="Name N frames to label, spread over the recording."),
    ] = 0,
    json: JsonFlag = False,
) -> None:
    """Tell the class of each frame, or that it is none of those that were learnt."""
    from tomoskin.extras.classes.classifier import CLASSES

    with Bar("learning"):
        loaded = CLASSES.read(calibration)
    classifier = loaded.model
    given = Recorded.of(recording, skin, reference).onto(loaded)
    data, dv = given.data, given.dv
    say_scale(given, [loaded])
    with Bar("classifying"):
        answers = classifier.predict(dv)
    count = min(ask, len(dv))  # evenly: the least sure ones would show one class too often
    asked = [(2 * k + 1) * len(dv) // (2 * count) for k in range(count)]
    names = classifier.examples.codes.names
    frames = _documents(data, answers)
    if out is not None:
        _write(out, frames, names, overwrite=force)
    tell({"names": names, "frames": frames, "ask": asked}, _lines(answers, asked), json=json)


def _documents(data: Recording, answers: Answers) -> list[dict[str, Any]]:
    return [
        {
            "frame": frame,
            "time_s": float(data.time[frame]),
            "class": label,
            "probability": float(answers.probability[frame]),
            "unknown": bool(answers.rejected[frame]),
            "each": answers.each[frame].tolist(),
        }
        for frame, label in enumerate(answers.label)
    ]


def _write(
    path: Path, frames: list[dict[str, Any]], names: tuple[str, ...], *, overwrite: bool
) -> None:
    rows: list[list[object]] = [["frame", "time_s", "class", "probability", "unknown", *names]]
    for row in frames:
        when, sure, unknown = f"{row['time_s']:.6f}", row["probability"], int(row["unknown"])
        each = [f"{p:.4f}" for p in row["each"]]
        rows.append([row["frame"], when, row["class"], f"{sure:.4f}", unknown, *each])
    write_rows(path, rows, overwrite=overwrite)


def _lines(answers: Answers, asked: list[int]) -> Iterator[str]:
    rows = list(zip(answers.label, answers.rejected.tolist(), answers.probability, strict=True))
    runs = [list(run) for _, run in groupby(enumerate(rows), key=lambda item: item[1][:2])]
    for run in runs[:_SHOWN]:
        (first, (label, rejected, _)), (last, _) = run[0], run[-1]
        sure = min(probability for _, (_, _, probability) in run)
        text = f"unknown (nearest: {label})" if rejected else f"{label}  {100 * sure:.0f} % or more"
        yield f"frames {first:>4} to {last:>4}  {text}"
    if len(runs) > _SHOWN:
        yield f"… and {len(rows) - runs[_SHOWN][0][0]} more frames: --out writes all"
    yield f"{int(answers.rejected.sum())} of {len(rows)} frames show an unknown class"
    if asked:
        yield f"label frames {', '.join(map(str, asked))}"
