"""``tomoskin image``: reconstruct a recording off-line."""

from __future__ import annotations

from collections import Counter
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from tomoskin.cli.alpha_option import AlphaOption, said, with_alpha
from tomoskin.cli.bend_option import BendOption, with_bends
from tomoskin.cli.display_option import LimitOption, PercentFlag, SmoothOption, display_of
from tomoskin.cli.named_files import TABLE, ForceFlag, Reads, Writes
from tomoskin.cli.output import JsonFlag, emit
from tomoskin.cli.progress import Bar
from tomoskin.cli.recording import (
    FramesOption,
    ReferenceOption,
    frame_range,
    idle_frames,
    say_notes,
)
from tomoskin.cli.skin_choice import SkinOption, skin_for_file
from tomoskin.cli.states_option import StatesOption, with_states
from tomoskin.cli.time_option import TimeConstantOption, filter_said, with_time_constant

if TYPE_CHECKING:
    from collections.abc import Sequence

    from tomoskin.pattern import Pattern
    from tomoskin.pipeline import Prepared, Reconstruction
    from tomoskin.signal import Recording
    from tomoskin.skin import Skin


IMAGES = {
    ".png": "pictures of some frames",
    ".npz": "images of all frames with their mesh",
    ".vtu": "the mesh with a field for each frame",
}


def image(
    recording: Annotated[
        Path, typer.Argument(metavar="INPUT", help="Recording or .npz file."), Reads()
    ],
    skin: SkinOption = None,
    reference: ReferenceOption = None,
    frames: FramesOption = None,
    alpha: AlphaOption = None,
    time_constant: TimeConstantOption = None,
    bend: BendOption = None,
    states: StatesOption = None,
    out: Annotated[
        Path | None,
        typer.Option(metavar="X.png|.npz|.vtu", help="Where the images go."),
        Writes(IMAGES),
    ] = None,
    touches: Annotated[
        Path | None,
        typer.Option(metavar="X.csv", help="Where the touches go."),
        Writes(TABLE),
    ] = None,
    force: ForceFlag = False,
    percent: PercentFlag = False,
    limit: LimitOption = None,
    smooth: SmoothOption = None,
    json: JsonFlag = False,
) -> None:
    """Reconstruct a recording: images, and the touches in them."""
    from tomoskin.cli.image_files import WRITERS
    from tomoskin.formats import read_recording
    from tomoskin.pipeline import prepare, reconstruct

    told = skin_for_file(skin, recording)
    chosen, rule = with_alpha(told, alpha)
    chosen = with_time_constant(chosen, time_constant)
    display = display_of(chosen, percent=percent, limit=limit, smooth=smooth)
    with Bar("preparing"):
        prepared = with_states(with_bends(prepare(chosen), bend), states, told)
    whole = read_recording(recording).in_order_of(prepared.pattern)
    say_notes(whole)
    idle = idle_frames(whole, reference, prepared.pattern)
    start, stop = frame_range(whole, frames)
    with Bar("reconstructing") as bar:
        found = reconstruct(prepared, whole.part(start, stop), idle, rule=rule, advance=bar)
    found = found.numbered_from(start)
    if touches is not None:
        _write_touches(touches, whole, found, prepared.skin, overwrite=force)
    if out is not None:
        WRITERS[out.suffix.lower()](out, prepared, found, display, overwrite=force)
    _report(recording, found, prepared, json=json)


def _write_touches(
    path: Path, recording: Recording, found: Reconstruction, skin: Skin, *, overwrite: bool
) -> None:
    from tomoskin.formats import write_touches

    rows = zip(found.frames.tolist(), found.touches, strict=True)
    timed = ((f, float(recording.time[f]), t) for f, t in rows)
    write_touches(path, timed, skin.surface, overwrite=overwrite)


def _report(source: Path, found: Reconstruction, prepared: Prepared, *, json: bool) -> None:
    _warn(source, found, prepared.pattern)
    if json:
        emit(_document(found, prepared))
        return
    typer.echo(f"{len(found.frames)} frames, {sum(map(len, found.touches))} touches")
    typer.echo(said(found.choice))
    if prepared.modes is not None:
        typer.echo(filter_said(prepared.skin))
    if found.bends:
        states = Counter(reading.state for reading in found.bends if reading)
        typer.echo(", ".join(f"{state}: {count} frames" for state, count in states.items()))
    if found.states:
        told = Counter("unknown" if s.unknown else s.name for s in found.states)
        typer.echo(", ".join(f"{state}: {count} frames" for state, count in told.items()))
    for frame, touches in list(zip(found.frames.tolist(), found.touches, strict=True))[:_SHOWN]:
        for t in touches:
            r = t.detection
            typer.echo(
                f"frame {frame:>4}  touch {t.id:>3}  x {1e3 * r.x:+7.1f} mm  y {1e3 * r.y:+7.1f} mm"
                f"  area {1e6 * r.area:7.0f} mm²  peak {r.peak:+.3g} {found.unit}"
            )
    if len(found.frames) > _SHOWN:
        typer.echo(f"… and {len(found.frames) - _SHOWN} frames more: --touches writes them all")


def _warn(source: Path, found: Reconstruction, pattern: Pattern) -> None:
    """Say on stderr what was left out, and what looks wrong."""
    from tomoskin.pipeline import DOUBTED

    if len(found.rows_left_out):
        rows = found.rows_left_out.tolist()
        typer.echo(
            f"tomoskin: {source}: {len(rows)} rows hold no finite values and were left out: "
            + "; ".join(map(pattern.row_text, rows)),
            err=True,
        )
    counted = zip(found.frames.tolist(), found.rows_missing.tolist(), strict=True)
    named = [f"{frame} ({_rows(count)})" for frame, count in counted if count]
    if named:
        typer.echo(
            f"tomoskin: {source}: {len(named)} frames hold rows that are not finite, and were "
            f"imaged without these: {_listed(named)}",
            err=True,
        )
    if len(found.left_out):
        typer.echo(
            f"tomoskin: {source}: {len(found.left_out)} frames hold too many values that are not "
            f"finite and were left out: {_listed(found.left_out.tolist())}",
            err=True,
        )
    if found.agreement < DOUBTED:
        typer.echo(
            f"tomoskin: {source}: the reference agrees with this skin's model by only "
            f"{found.agreement:.2f} (1 = proportional): check --skin and the electrodes' order",
            err=True,
        )


_SHOWN = 20


def _document(found: Reconstruction, prepared: Prepared) -> dict[str, Any]:
    lacking = zip(found.frames.tolist(), found.rows_missing.tolist(), strict=True)
    return {
        "frames": len(found.frames),
        "rows_missing": {str(frame): rows for frame, rows in lacking if rows},
        "left_out": found.left_out.tolist(),
        "rows_left_out": found.rows_left_out.tolist(),
        "agreement": found.agreement,
        "unit": found.unit,
        "alpha": found.choice.alpha,
        "rule": found.choice.rule,
        "time_constant_s": prepared.skin.inverse.time_constant,
        "bends": [
            {"frame": f, "angle_rad": b.angle, "sd_rad": b.sd, "axis_rad": b.axis, "state": b.state}
            for f, b in zip(found.frames.tolist(), found.bends, strict=False)
            if b
        ],
        "states": [
            {"frame": f, **asdict(state)}
            for f, state in zip(found.frames.tolist(), found.states, strict=False)
        ],
        "touches": [
            {
                "frame": f,
                "id": t.id,
                "x_m": t.detection.x,
                "y_m": t.detection.y,
                "peak": t.detection.peak,
            }
            for f, touches in zip(found.frames.tolist(), found.touches, strict=True)
            for t in touches
        ],
    }


def _listed(frames: Sequence[object]) -> str:
    shown = ", ".join(map(str, frames[:10]))
    return f"{shown}, …" if len(frames) > 10 else shown


def _rows(count: int) -> str:
    return "1 row" if count == 1 else f"{count} rows"
