"""What says how hard or how deep the press of a frame is: options such as ``LABEL=A:B`` for frames
A to B-1, and arrays of the file."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import typer

from tomoskin.cli.output import remark
from tomoskin.core import DataError, FloatArray

if TYPE_CHECKING:
    from tomoskin.core import Arrays, Detection, Touch
    from tomoskin.learning import LabelledPresses, Measurand
    from tomoskin.pipeline import Reconstruction


def labels_of_frames(given: Sequence[str], n: int, option: str, label: str) -> list[str]:
    """(n,) label of each frame, "" without one.

    ``option`` and ``label`` are what the command calls them: ``--class``, ``NAME``.
    Raises BadParameter on a malformed text, DataError on frames that do not exist or that have
    two labels.
    """
    labels = [""] * n
    for text in given:
        name, equals, span = text.rpartition("=")
        first, colon, last = span.partition(":")
        if not (name and equals and colon and first.isdigit() and last.isdigit()):
            raise typer.BadParameter(f'expected {label}=A:B, got "{text}"', param_hint=option)
        start, stop = int(first), int(last)
        if not 0 <= start < stop <= n:
            raise DataError(f"expected frames within 0:{n}, got {span}", where=f"{option} {name}")
        taken = sorted({labels[k] for k in range(start, stop)} - {"", name})
        if taken:
            raise DataError(
                f"frames of {span} already have the label {taken[0]}",
                where=f"{option} {name}",
                hint=f"give each frame one {label}",
            )
        labels[start:stop] = [name] * (stop - start)
    return labels


def labelled_arrays(path: Path) -> Arrays:
    """The arrays of an interchange file; none of any other file."""
    from tomoskin.core import load_arrays
    from tomoskin.files.imports import is_session

    return {} if is_session(path) or path.suffix.lower() != ".npz" else load_arrays(path)


def amounts(
    path: Path, n: int, given: list[str] | None, unit: str | None, of: Measurand
) -> FloatArray:
    """(n,) amount in each frame, SI; NaN without one.

    Without a ``unit`` it is that in which people are told, and SI in a file.
    """
    from tomoskin.core import real_numbers

    option = _OPTION[of.name]
    if given:
        named = labels_of_frames(given, n, option, of.name.upper())
        values = [_number(text, of, option) if text else np.nan for text in named]
        return of.units[unit or of.shown] * np.array(values)
    arrays = labelled_arrays(path)
    if of.key not in arrays:
        raise DataError(
            f"holds no {of.plural}: expected {of.key} (n_frames,), NaN where none is known",
            where=str(path),
            hint=f"add {of.key}, or {option} 4.9=40:60 {option} 9.8=80:100",
        )
    labels = real_numbers(arrays, of.key, str(path))
    if labels.shape not in ((n,), (n, 1)):  # older sets of single presses have a column
        raise DataError(
            f"expected {of.key} of shape ({n},), one {of.name} for each frame, got {labels.shape}",
            where=str(path),
            hint=f"give the {of.name} of frames with one press, and NaN of all others",
        )
    return labels.ravel() * (of.units[unit] if unit else 1.0)


_OPTION = {"force": "--weight", "depth": "--depth"}
"""Options that label frames, by what they label."""


def _number(text: str, of: Measurand, option: str) -> float:
    try:
        number = float(text)
    except ValueError:
        number = np.nan
    if not np.isfinite(number):
        raise typer.BadParameter(
            f'expected a number as {of.name.upper()}, got "{text}"', param_hint=option
        )
    return number


def labelled_presses(
    path: Path, result: Reconstruction, amount: FloatArray, time: FloatArray, of: Measurand
) -> LabelledPresses:
    """Touches of frames with one touch; a press is what one does at one spot until it is lifted."""
    from tomoskin.learning import LabelledPresses

    rows: list[tuple[Detection, float, int, float]] = []
    without, several, number = 0, 0, 0
    before: Touch | None = None
    for frame, touches in zip(result.frames.tolist(), result.touches, strict=True):
        labelled = bool(np.isfinite(amount[frame]))
        without += labelled and not touches
        several += labelled and len(touches) > 1
        alone = touches[0] if len(touches) == 1 else None
        if alone is not None:
            number += before is None or not _goes_on(before, alone)
            rows.append((alone.detection, float(amount[frame]), number, float(time[frame])))
        before = alone
    if without or several:
        remark(
            f"{path}: of the frames with a {of.name}, {without} show no touch and {several} show "
            "several touches; these were left out"
        )
    detections, *labels = zip(*rows, strict=True) if rows else ((), (), (), ())
    labels_of, press, times = (np.array(column) for column in labels)
    return LabelledPresses.of(detections, labels_of, press, times, of.name)


def _goes_on(before: Touch, touch: Touch) -> bool:
    """Whether it is the press of the frame before: the same touch within its own radius."""
    was, now = before.detection, touch.detection
    apart = np.hypot(now.x - was.x, now.y - was.y)
    return before.id == touch.id and bool(apart**2 <= now.area / np.pi)
