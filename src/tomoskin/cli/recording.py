"""Options that name parts of a recording: the untouched frames, and a range."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from tomoskin.core import DataError

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from tomoskin.pattern import Pattern
    from tomoskin.pipeline import Idle
    from tomoskin.signal import Recording

ReferenceOption = Annotated[
    str | None,
    typer.Option(
        metavar="first:N|frame:K|previous|FILE",
        help="Untouched frames, or previous: each frame against the one before. Without it the "
        "file's own reference, else its first frame (of a session those that the run took).",
    ),
]
FramesOption = Annotated[
    str | None, typer.Option(metavar="A:B", help="Only frames A to B-1 (from 0).")
]


def idle_frames(recording: Recording, spec: str | None, pattern: Pattern) -> Idle:
    """What the frames are held against; None for a file of differences."""
    from tomoskin.formats import read_recording

    if recording.is_change:
        if spec is not None:
            raise DataError(
                "holds differences, which need no reference",
                where=recording.source,
                hint="leave --reference out",
            )
        return None
    if spec == "previous":
        return "previous"
    if spec is None and recording.reference is not None:
        return recording.reference[None]
    given = f"first:{recording.idle}" if spec is None else spec
    kind, _, number = given.partition(":")
    if kind in ("first", "frame") and number.isdigit():
        return _frames_of(recording, kind, int(number))
    if not given or not Path(given).exists():
        raise DataError(
            f'expected first:N, frame:K, previous or a file, got "{given}"', where="--reference"
        )
    other = read_recording(Path(given))
    if other.is_change:
        raise DataError("holds differences, not an untouched skin", where=other.source)
    return other.in_order_of(pattern).voltages


def say_notes(recording: Recording) -> None:
    """What of the file was left out, on stderr."""
    for note in recording.notes:
        typer.echo(f"tomoskin: {recording.source}: {note}", err=True)


def _frames_of(recording: Recording, kind: str, number: int) -> NDArray[Any]:
    n = len(recording)
    if kind == "frame":
        if number >= n:
            raise DataError(
                f"expected a frame from 0 to {n - 1}, got {number}", where="--reference"
            )
        return recording.voltages[number : number + 1]
    if not 1 <= number <= n:
        raise DataError(f"expected first:1 to first:{n}, got first:{number}", where="--reference")
    return recording.voltages[:number]


def frame_range(recording: Recording, spec: str | None) -> tuple[int, int]:
    """First frame, and one past the last; all of them without ``spec``."""
    n = len(recording)
    first, colon, last = (spec or ":").partition(":")
    if not (colon and (first or "0").isdigit() and (last or "0").isdigit()):
        raise typer.BadParameter(f'expected A:B, got "{spec}"', param_hint="--frames")
    start, stop = int(first or 0), int(last or n)
    if not 0 <= start < stop <= n:
        raise DataError(f"expected frames within 0:{n}, got {spec}", where="--frames")
    return start, stop
