"""``tomoskin session``: what a recorded session holds, mended, and in other formats."""

from __future__ import annotations

from dataclasses import asdict
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from tomoskin.cli.contents import group
from tomoskin.cli.output import JsonFlag, emit, ending
from tomoskin.cli.progress import Bar
from tomoskin.cli.recording import say_notes

if TYPE_CHECKING:
    from tomoskin.session import Lost, Repaired, SessionInfo

app = group("Inspect, mend and convert recorded sessions.")

_A_YEAR = 3.15e7
"""Log times of less are seconds of a clock that began with the machine, not of the day."""

_NO_CLOCK = 0.01
"""No clock of a board is so far off."""

_File = Annotated[Path, typer.Argument(metavar="FILE", help="A session, such as run.mcap.")]


@app.command()
def info(file: _File, json: JsonFlag = False) -> None:
    """Say what a session holds: duration, rate, gaps, drops, skin, touches."""
    from tomoskin.session import session_info

    with Bar("reading") as bar:
        found = session_info(file, bar)
    if json:
        emit(asdict(found))
        return
    for name, text in _lines(found):
        typer.echo(f"{name:<12} {text}")
    if found.torn:
        typer.echo(f"tomoskin: {file}: {found.torn} (tomoskin session repair ends it)", err=True)


@app.command()
def repair(
    file: _File,
    out: Annotated[
        Path | None, typer.Option(help="Where to; without it FILE with .repaired in its name.")
    ] = None,
    skin: Annotated[
        str | None, typer.Option(help="Built-in name or path, where the file's own is lost.")
    ] = None,
    json: JsonFlag = False,
) -> None:
    """Recover every whole chunk of a damaged session into a new file."""
    from tomoskin.session import repair
    from tomoskin.skin import Skin

    target = out or file.with_suffix(f".repaired{file.suffix}")
    with Bar("repairing") as bar:
        found = repair(file, target, skin=Skin.load(skin) if skin else None, advance=bar)
    if json:
        emit(asdict(found))
        return
    frames = found.messages.get("/frames", 0)
    typer.echo(f"{target}: {found.chunks} chunks, {frames} frames recovered; {file} is untouched")
    for text in _losses(found):
        typer.echo(text)


@app.command()
def export(
    file: _File,
    out: Annotated[
        Path,
        typer.Argument(
            metavar="OUT", help="X.csv, .parquet, .h5, .npz, .mat, .vtu, .png, .gif or .mp4."
        ),
    ],
    touches: Annotated[
        Path | None, typer.Option(metavar="X.csv", help="Where the recorded touches go.")
    ] = None,
    every: Annotated[
        float, typer.Option(min=1e-3, help="Seconds between two images, where there are images.")
    ] = 0.1,
) -> None:
    """Convert a session: voltages, or the images that they give again."""
    from tomoskin.live import WRITERS, Export
    from tomoskin.session import SessionReader

    write = WRITERS[ending(out, WRITERS, "OUT")]
    with SessionReader(file) as session, Bar(f"writing {out}") as bar:
        asked = Export(session, every, bar)
        write(asked, out)
        if touches is not None:
            asked.touches(touches)
        if session.torn:
            typer.echo(f"tomoskin: {file}: {session.torn}", err=True)
    series = out.with_suffix(".pvd")  # names the files of a series
    for path in filter(None, (out, series, touches)):
        if path.is_file():
            typer.echo(f"{path}: {path.stat().st_size / 1e6:.1f} MB")


@app.command("import")
def import_recording(
    file: Annotated[Path, typer.Argument(metavar="INPUT", help="Any recording that can be read.")],
    out: Annotated[Path, typer.Argument(metavar="OUT.npz", help="Interchange file.")],
) -> None:
    """Convert a recording of another program to the interchange file."""
    from tomoskin.session import read_recording, write_interchange

    ending(out, [".npz"], "OUT")
    recording = read_recording(file)
    write_interchange(out, recording)
    typer.echo(f"{out}: {len(recording)} frames of {len(recording.drive)} rows")
    say_notes(recording)


def _lines(found: SessionInfo) -> list[tuple[str, str]]:
    begun = ""
    if found.begun is not None:
        begun = f", begun {datetime.fromtimestamp(found.begun, UTC):%Y-%m-%d %H:%M:%S} UTC"
    lines = [
        ("file", f"{found.path}, {found.size / 1e6:.2f} MB"),
        ("duration", f"{found.duration:.2f} s{begun}"),
        ("skin", f"{found.skin}: {found.electrodes} electrodes, {found.rows} measurements"),
        ("frames", f"{found.frames}, {found.rate:.1f} frames/s, longest pause "
                   f"{1e3 * found.longest_pause:.0f} ms"),
        ("missing", f"{found.lost} frames in {found.gaps} gaps, {found.dropped} dropped by the "
                    f"board, {found.skipped} skipped, {found.held} held"),
        ("touches", str(found.touches)),
    ]  # fmt: skip
    if found.attached:
        lines.append(("files inside", ", ".join(found.attached)))
    if found.device:
        board, firmware = found.device.get("unique_id"), found.device.get("firmware")
        lines.append(("board", f"{board}, firmware {firmware}"))
    if found.clock:
        rate, residual = found.clock.tick_rate, 1e3 * found.clock.residual
        nominal = found.device.get("tick_rate")
        drift = f", {_drift(found.clock.drift(nominal))}" if nominal else ""
        lines.append(
            ("clock", f"{rate:.1f} ticks/s by this host{drift}; frames come {residual:.3f} ms late")
        )
    if found.events:
        counted = ", ".join(f"{kind} {count}" for kind, count in sorted(found.events.items()))
        lines.append(("events", counted))
    return lines


def _drift(part: float) -> str:
    """Of the board's clock against ours; the twin's may run much faster than time."""
    if abs(part) > _NO_CLOCK:
        return f"{1 + part:.3g} times as fast as it says: not in real time"
    return f"{1e6 * part:+.1f} ppm"


def _losses(found: Repaired) -> list[str]:
    if not found.lost:
        return ["nothing is lost" if found.ended else "nothing is lost but the open chunk's end"]
    return [_loss(lost) for lost in found.lost]


def _loss(lost: Lost) -> str:
    size = lost.stop - lost.start
    when = f"after {_moment(lost.after)}" if lost.after else "at the beginning"
    until = f", before {_moment(lost.before)}" if lost.before is not None else ""
    return f"lost: {size} bytes from byte {lost.start} on, {when}{until}"


def _moment(log_time: int) -> str:
    """Time of day, or s where the file does not know the day."""
    seconds = log_time / 1e9
    if seconds < _A_YEAR:
        return f"{seconds:.3f} s"
    return f"{datetime.fromtimestamp(seconds, UTC):%Y-%m-%d %H:%M:%S.%f}"[:-3] + " UTC"
