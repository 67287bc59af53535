"""``tomoskin image``: reconstruct a recording off-line."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from tomoskin.cli.output import JsonFlag, emit
from tomoskin.core import DataError

if TYPE_CHECKING:
    from tomoskin.core import IntArray
    from tomoskin.live import Reconstruction
    from tomoskin.pattern import Pattern
    from tomoskin.session import Recording


def image(
    recording: Annotated[Path, typer.Argument(metavar="INPUT", help="Recording or .npz file.")],
    skin: Annotated[str, typer.Option(help="Built-in name or path.")] = "textile-disc-8",
    reference: Annotated[
        str | None,
        typer.Option(
            metavar="first:N|frame:K|FILE",
            help="Untouched frames; without it the file's own reference, else its first frame.",
        ),
    ] = None,
    frames: Annotated[
        str | None, typer.Option(metavar="A:B", help="Only frames A to B-1 (from 0).")
    ] = None,
    out: Annotated[
        Path | None, typer.Option(metavar="X.png|.npz|.vtu", help="Where the images go.")
    ] = None,
    touches: Annotated[
        Path | None, typer.Option(metavar="X.csv", help="Where the touches go.")
    ] = None,
    json: JsonFlag = False,
) -> None:
    """Reconstruct a recording: images, and the touches in them."""
    from tomoskin.live import prepare, reconstruct
    from tomoskin.session import read_recording
    from tomoskin.skin import Skin

    write = _writer(out)
    prepared = prepare(Skin.load(skin))
    whole = read_recording(recording).in_order_of(prepared.pattern)
    idle = _idle(whole, reference, prepared.pattern)
    start, stop = _range(whole, frames)
    found = reconstruct(prepared, whole.part(start, stop), idle).numbered_from(start)
    if touches is not None:
        _write_touches(touches, whole, found)
    if out is not None:
        write(out, prepared, found)
    _report(recording, found, json=json)


def _idle(recording: Recording, spec: str | None, pattern: Pattern) -> Any:
    """(n, n_meas) frames of the untouched skin, None for a file of differences."""
    from tomoskin.session import read_recording

    if recording.is_change:
        if spec is not None:
            raise DataError(
                "holds differences, which need no reference",
                where=recording.source,
                hint="leave --reference out",
            )
        return None
    if spec is None and recording.reference is not None:
        return recording.reference[None]
    kind, _, number = (spec or "first:1").partition(":")
    if kind in ("first", "frame") and number.isdigit():
        return _frames_of(recording, kind, int(number))
    path = Path(spec or "")
    if not path.exists():
        raise DataError(f'expected first:N, frame:K or a file, got "{spec}"', where="--reference")
    other = read_recording(path)
    if other.is_change:
        raise DataError("holds differences, not an untouched skin", where=other.source)
    return other.in_order_of(pattern).voltages


def _frames_of(recording: Recording, kind: str, number: int) -> Any:
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


def _range(recording: Recording, spec: str | None) -> tuple[int, int]:
    n = len(recording)
    first, colon, last = (spec or ":").partition(":")
    if not (colon and (first or "0").isdigit() and (last or "0").isdigit()):
        raise typer.BadParameter(f'expected A:B, got "{spec}"', param_hint="--frames")
    start, stop = int(first or 0), int(last or n)
    if not 0 <= start < stop <= n:
        raise DataError(f"expected frames within 0:{n}, got {spec}", where="--frames")
    return start, stop


def _writer(out: Path | None) -> Any:
    from tomoskin.cli import image_files

    suffix = "" if out is None else out.suffix.lower()
    if out is not None and suffix not in image_files.WRITERS:
        raise typer.BadParameter(
            f"expected a name that ends in {', '.join(image_files.WRITERS)}, got {out}",
            param_hint="--out",
        )
    return image_files.WRITERS.get(suffix)


def _write_touches(path: Path, recording: Recording, found: Reconstruction) -> None:
    from tomoskin.session import write_touches

    rows = zip(found.frames.tolist(), found.touches, strict=True)
    write_touches(path, ((f, float(recording.time[f]), t) for f, t in rows))


def _report(source: Path, found: Reconstruction, *, json: bool) -> None:
    from tomoskin.live import DOUBTED

    if len(found.left_out):
        typer.echo(
            f"tomoskin: {source}: {len(found.left_out)} frames hold values that are not finite and "
            f"were left out: {_listed(found.left_out)}",
            err=True,
        )
    if found.agreement < DOUBTED:
        typer.echo(
            f"tomoskin: {source}: the reference agrees with this skin's model by only "
            f"{found.agreement:.2f} (1 = proportional): check --skin and the electrodes' order",
            err=True,
        )
    if json:
        emit(_document(found))
        return
    typer.echo(f"{len(found.frames)} frames, {sum(map(len, found.touches))} touches")
    for frame, touches in list(zip(found.frames.tolist(), found.touches, strict=True))[:_SHOWN]:
        for t in touches:
            r = t.reading
            typer.echo(
                f"frame {frame:>4}  touch {t.id:>3}  x {1e3 * r.x:+7.1f} mm  y {1e3 * r.y:+7.1f} mm"
                f"  area {1e6 * r.area:7.0f} mm²  peak {r.peak:+.3g} {found.unit}"
            )
    if len(found.frames) > _SHOWN:
        typer.echo(f"… and {len(found.frames) - _SHOWN} frames more: --touches writes them all")


_SHOWN = 20


def _document(found: Reconstruction) -> dict[str, Any]:
    return {
        "frames": len(found.frames),
        "left_out": found.left_out.tolist(),
        "agreement": found.agreement,
        "unit": found.unit,
        "touches": [
            {"frame": f, "id": t.id, "x_m": t.reading.x, "y_m": t.reading.y, "peak": t.reading.peak}
            for f, touches in zip(found.frames.tolist(), found.touches, strict=True)
            for t in touches
        ],
    }


def _listed(frames: IntArray) -> str:
    shown = ", ".join(map(str, frames[:10].tolist()))
    return f"{shown}, …" if len(frames) > 10 else shown
