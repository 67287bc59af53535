"""``tomoskin calibrate bend``: learn what bends of a skin do, from a few known ones."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from tomoskin.cli.named_files import ForceFlag, Reads
from tomoskin.cli.options import CalibrationOut, ReferenceOption
from tomoskin.cli.output import Bar, JsonFlag, emit
from tomoskin.cli.recording import idle_frames, say_notes
from tomoskin.core import DataError

if TYPE_CHECKING:
    from tomoskin.core import FloatArray
    from tomoskin.sensing.signal import Recording

_ALONG_Y = 90.0


def calibrate_bend(
    recording: Annotated[
        Path,
        typer.Argument(metavar="INPUT", help="Frames of known bends, without touches."),
        Reads(),
    ],
    out: CalibrationOut,
    skin: Annotated[
        str | None, typer.Option(help="Built-in name or path. Default: the session's skin.")
    ] = None,
    bend: Annotated[
        list[str] | None,
        typer.Option(
            metavar="DEG[@AXIS]=A:B",
            help="Label: frames A to B-1 are bent by this angle about an axis in this direction "
            f"from x (default {_ALONG_Y:.0f}). Can be repeated. Default: the session's own "
            "truth.",
        ),
    ] = None,
    reference: ReferenceOption = None,
    force: ForceFlag = False,
    json: JsonFlag = False,
) -> None:
    """Learn the bends of a skin: touches are then separated from them, and angles estimated."""
    import numpy as np

    from tomoskin.cli.choices import skin_for_file
    from tomoskin.files.imports import read_recording
    from tomoskin.learning import BENDS, BendExamples, BendModel
    from tomoskin.pipeline import prepare, voltage_covariance
    from tomoskin.sensing.signal import Reference

    chosen = skin_for_file(skin, recording)
    with Bar("preparing"):
        prepared = prepare(chosen)
    data = read_recording(recording).in_order_of(prepared.pattern)
    say_notes(data)
    idle = idle_frames(data, reference, prepared.pattern)
    if idle is None or isinstance(idle, str):
        raise DataError("expected voltages with untouched frames, got none", where=str(recording))
    straight = Reference.of(np.asarray(idle, dtype=np.float64))
    frames, angle, axis = _from_options(bend, len(data)) if bend else _from_truth(recording, data)
    examples = BendExamples.checked(data.voltages[frames] - straight.mean, angle, axis,
                               data.time[frames])  # fmt: skip
    with Bar("learning"):
        model = BendModel.learn(examples, voltage_covariance(prepared, straight))
    BENDS.of(model, prepared.pattern, chosen).write(out, overwrite=force)
    facts = {
        "frames": len(examples.angle),
        "directions": model.n_modes,
        "axes_deg": np.degrees(examples.axes).round(1).tolist(),
        "error_deg": math.degrees(model.error),
        "remembers": model.remembers,
    }
    if json:
        emit(facts)
        return
    typer.echo(
        f"{facts['frames']} frames, {facts['directions']} directions; in cross-validation "
        f"the RMS error of an angle is {facts['error_deg']:.2f}°"
    )
    if model.remembers:
        typer.echo("the sheet's memory is part of the calibration: process frames in their order")
    if not examples.turns:
        typer.echo(
            "the axis of a bend is estimated from three directions on; here the given axis is used"
        )


def _from_options(given: list[str], n: int) -> tuple[list[int], FloatArray, FloatArray]:
    """Frames, angles and axes, rad, of the options."""
    import numpy as np

    rows: dict[int, tuple[float, float]] = {}
    for text in given:
        name, _, span = text.partition("=")
        first, colon, last = span.partition(":")
        degrees, _, axis = name.partition("@")
        try:
            value = float(degrees), float(axis or _ALONG_Y)
            start, stop = int(first), int(last)
        except ValueError:
            raise typer.BadParameter(
                f'expected DEG=A:B or DEG@AXIS=A:B, got "{text}"', param_hint="--bend"
            ) from None
        if not (colon and 0 <= start < stop <= n and all(map(math.isfinite, value))):
            raise DataError(f"expected frames within 0:{n}, got {span}", where=f"--bend {name}")
        if any(k in rows for k in range(start, stop)):
            raise DataError(f"frames of {span} already have a label", where=f"--bend {name}")
        rows |= dict.fromkeys(range(start, stop), value)
    frames = sorted(rows)
    angle, axis_of = np.radians([rows[k] for k in frames]).T
    return frames, angle, axis_of


def _from_truth(path: Path, data: Recording) -> tuple[list[int], FloatArray, FloatArray]:
    """The same from a session's truth: frames that nothing presses, with one bend or none."""
    import numpy as np

    from tomoskin.files.imports import is_session
    from tomoskin.files.session import SessionReader

    if not is_session(path):
        raise DataError(
            "holds no angles of bends",
            where=str(path),
            hint="give them: --bend 0=0:20 --bend 30=40:60",
        )
    with SessionReader(path) as session:
        truth = list(session.truth())
    at = np.searchsorted([item.host_time for item in truth], data.time, side="right") - 1
    frames, rows = [], []
    for frame, number in enumerate(at.tolist()):
        item = truth[number] if number >= 0 else None
        if item is None or item.presses or len(item.bends) > 1:
            continue
        bend = item.bends[0] if item.bends else {"angle": 0.0, "axis": math.pi / 2}
        if "angle" in bend:
            frames.append(frame)
            rows.append((float(bend["angle"]), float(bend["axis"])))
    if not frames:
        raise DataError(
            "holds no angles of bends that the twin made",
            where=str(path),
            hint="give them: --bend 0=0:20 --bend 30=40:60",
        )
    angle, axis = np.array(rows).T
    return frames, angle, axis
