"""Which frames show which state of a body: options such as ``DEG=A:B``, a table, or what the twin
has noted in a session."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import typer

from tomoskin.cli import labels_of_frames
from tomoskin.core import DataError, FloatArray

if TYPE_CHECKING:
    from tomoskin.extras.body.body_model import BodyExamples
    from tomoskin.sensing.signal import Recording

ALONG_Y = 90.0
"""Direction of a bend's axis from x, degrees, unless one is given."""


MOST_ANGLE = 2 * math.pi
"""rad: a joint that turns farther has gone round."""


def body_examples(
    path: Path, data: Recording, rest: FloatArray, given: list[str] | None, table: Path | None
) -> BodyExamples:
    """Frames with the states of the body that options or a ``table`` name, else those of the
    session's truth that nothing presses; of a file without any, all frames without a state."""
    from tomoskin.extras.body.body_model import BodyExamples

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
    for name in (k for k in names if k.startswith("angle") and not _in_degrees(k)):
        if (most := float(np.nanmax(np.abs(columns[name]), initial=0.0))) > MOST_ANGLE:
            raise DataError(
                f"expected {name} in rad, up to {MOST_ANGLE:.2f}, got {most:.3g}",
                where=str(table),
                hint=f"if it is in degrees, name the column {name}_deg",
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
