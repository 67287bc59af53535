"""What says where, how hard or how bent a frame is: options such as ``LABEL=A:B`` for frames A to
B-1, arrays of the file, and what the twin has noted in a session."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import typer

from tomoskin.cli.output import remark
from tomoskin.core import DataError, FloatArray

if TYPE_CHECKING:
    from tomoskin.core import Arrays, Detection, Touch
    from tomoskin.learning import BodyExamples, Codes, Examples, LabelledPresses, Measurand
    from tomoskin.pipeline import Reconstruction
    from tomoskin.sensing.signal import Recording

ALONG_Y = 90.0
"""Direction of a bend's axis from x, degrees, unless one is given."""


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


def _arrays(path: Path) -> Arrays:
    """The arrays of an interchange file; none of any other file."""
    from tomoskin.core import load_arrays
    from tomoskin.files.imports import is_session

    return {} if is_session(path) or path.suffix.lower() != ".npz" else load_arrays(path)


def class_examples(
    path: Path, dv: FloatArray, given: list[str] | None, codes: Codes | None
) -> Examples:
    """Examples of the frames ``dv`` (n, n_meas) of a file; ``codes`` where they are known before.

    Raises
    ------
    DataError
        When nothing says what the frames show (and ``codes`` are not known), or it is no label.
    """
    from tomoskin.core import real_numbers
    from tomoskin.learning import Codes, Examples

    arrays = {} if given else _arrays(path)
    if "flags" in arrays:
        flags = real_numbers(arrays, "flags", str(path))
        count = flags.shape[1] if flags.ndim == 2 else 0
        names = arrays.get("flag_names", np.arange(1, count + 1)).ravel().tolist()
        own = Codes(tuple(map(str, names)), exclusive=False)
        return Examples.checked(codes or own, dv, flags)
    if given or "class" in arrays:
        labels = (
            labels_of_frames(given, len(dv), "--class", "NAME")
            if given
            else [str(s) for s in arrays["class"].tolist()]
        )
        codes = codes or Codes.of_labels(labels)
        return Examples.checked(codes, dv, codes.flags_of(labels))
    if codes is None:
        raise DataError(
            "holds no classes: expected class (n_frames,) or flags (n_frames, f)",
            where=str(path),
            hint="add one of them, or --class idle=0:40 --class touch=40:80",
        )
    return Examples.checked(codes, dv, np.full((len(dv), len(codes.names)), np.nan))


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
    arrays = _arrays(path)
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


def body_examples(
    path: Path, data: Recording, rest: FloatArray, given: list[str] | None, table: Path | None
) -> BodyExamples:
    """Frames with the states of the body that options or a ``table`` name, else those of the
    session's truth that nothing presses; of a file without any, all frames without a state."""
    from tomoskin.learning import BodyExamples

    known: dict[str, Any]
    if given:
        pairs = _named_bends(given, len(data))
        frames = sorted(pairs)
        angle, axis = np.array([pairs[frame] for frame in frames]).T
        known = {"angle": angle, "axis": axis}
    elif table is not None:
        frames, known = _tabled(table, len(data))
    else:
        frames, known = _true_states(path, data)
    return BodyExamples.checked(data.voltages[frames] - rest, data.time[frames], **known)


def _tabled(table: Path, n: int) -> tuple[list[int], dict[str, Any]]:
    """The states of a table with a column ``frame`` and one for each coordinate; angles that end
    in _deg are kept in rad."""
    from tomoskin.files.imports import read_columns

    columns = read_columns(table)
    names = [name for name in columns if name != "frame"]
    frames = columns.get("frame")
    if frames is None or not names:
        given = ", ".join(filter(None, columns)) or "none"
        raise DataError(
            f"expected columns frame and coordinates, got {given}",
            where=str(table),
            hint="for example: frame,angle_deg,stretch",
        )
    rising = np.diff(frames, prepend=-1.0) > 0
    wrong = np.flatnonzero(~(np.isin(frames, np.arange(n)) & rising))
    if len(wrong):
        raise DataError(
            f"expected frames from 0 to {n - 1} in their order, each once, got frame "
            f"{frames[wrong[0]]:g} in row {wrong[0] + 1}",
            where=str(table),
        )
    state = np.column_stack([columns[k] * (math.pi / 180 if _in_degrees(k) else 1) for k in names])
    if not np.isfinite(state).all():
        row = int(np.argmin(np.isfinite(state).all(axis=1)))
        raise DataError(
            f"expected a number in every column, got none for frame {frames[row]:.0f}",
            where=str(table),
            hint="leave out the lines of frames whose state is not known",
        )
    kept = tuple(k.removesuffix("_deg") if _in_degrees(k) else k for k in names)
    return frames.astype(int).tolist(), {"state": state, "names": kept}


def _in_degrees(name: str) -> bool:
    return name.startswith("angle") and name.endswith("_deg")


def _named_bends(given: list[str], n: int) -> dict[int, tuple[float, float]]:
    labels = labels_of_frames(given, n, "--bend", "DEG[@AXIS]")
    return {frame: _angles(text) for frame, text in enumerate(labels) if text}


def _angles(text: str) -> tuple[float, float]:
    degrees, _, axis = text.partition("@")
    try:
        angle = math.radians(float(degrees)), math.radians(float(axis or ALONG_Y))
    except ValueError:
        angle = math.nan, math.nan
    if not all(map(math.isfinite, angle)):
        raise typer.BadParameter(
            f'expected DEG=A:B or DEG@AXIS=A:B, got "{text}"', param_hint="--bend"
        )
    return angle


def _true_states(path: Path, data: Recording) -> tuple[list[int], dict[str, Any]]:
    from tomoskin.files.imports import is_session
    from tomoskin.files.session import SessionReader

    truth = []
    if is_session(path):
        with SessionReader(path) as session:
            truth = list(session.truth())
    if not any(item.bends for item in truth):
        return list(range(len(data))), {}
    at = np.searchsorted([item.host_time for item in truth], data.time, side="right") - 1
    frames = [k for k in np.flatnonzero(at >= 0).tolist() if not truth[at[k]].presses]
    bends = [{key: b[key] for b in truth[at[k]].bends for key in b} for k in frames]
    angle, stretch = (np.array([b.get(key, 0.0) for b in bends]) for key in ("angle", "strain"))
    axis = np.array([b["axis"] if "angle" in b else math.pi / 2 for b in bends])
    if not stretch.any():
        return frames, {"angle": angle, "axis": axis}
    about = axis[np.abs(angle).argmax()]
    state = np.column_stack([stretch, angle] if angle.any() else [stretch])
    return frames, {"state": state, "names": ("stretch", "angle")[: state.shape[1]], "axis": about}
