"""``tomoskin session``: what a recorded session holds, mended, and in other formats."""

from __future__ import annotations

from contextlib import ExitStack
from dataclasses import asdict
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Protocol

import typer

from tomoskin.cli.app import group
from tomoskin.cli.named_files import (
    RECORDING,
    Added,
    ForceFlag,
    Given,
    Reads,
    Writes,
    package_of,
)
from tomoskin.cli.named_parts import say_notes, span_lines, told_deformations
from tomoskin.cli.options import DeformationsOut, TouchesOut
from tomoskin.cli.output import Bar, JsonFlag, remark, tell
from tomoskin.core import Output, registered

if TYPE_CHECKING:
    from tomoskin.files.exports import Export
    from tomoskin.files.session import Lost, Repaired, SessionInfo

app = group("session")

_A_YEAR = 3.15e7
"""Log times of less are seconds of a clock that began with the machine, not of the day."""

_NO_CLOCK = 0.01
"""No clock of a board is so far off."""

_File = Annotated[Path, typer.Argument(metavar="FILE", help="Session, such as run.mcap."), Reads()]

EXPORTS = {
    ".csv": "a table of voltages",
    ".parquet": "the same for data tools",
    ".h5": "everything",
    ".npz": "an interchange file",
    ".mat": "EIDORS' structures",
    ".vtu": "a mesh for each moment",
    ".pvd": "the same",
    ".png": "a sheet of maps",
    ".gif": "a film",
    ".mp4": "a film",
}
"""What each ending of our own gives; more is in docs/session-file.md."""

_ENDINGS = ", ".join(ending for ending in (*EXPORTS, *registered("exports")) if ending != ".pvd")


class ExportOptions(Protocol):
    """What a record of options does that is added to ``session export``."""

    def check(self, out: Path, touches: Path | None) -> None:
        """Raise BadParameter where what is given has no effect on these files."""

    def applied(self, job: Export) -> Export:
        """The export as these options have it."""


def _mended(out: Path | None, given: Given, called: str) -> list[Output]:
    """The file that a repair makes."""
    return [Output(_repaired(given["file"], out), RECORDING, called if out else "")]


def _repaired(file: Path, out: Path | None) -> Path:
    return out or file.with_name(f"{file.stem}.repaired.mcap")


def _exported(out: Path | None, _: Given, called: str) -> list[Output]:
    """What an export writes: of a series more than the file that is named."""
    from tomoskin.files.exports import export_formats, series_files

    assert out is not None
    others = {ending: one.gives for ending, one in export_formats().items() if one.gives}
    endings = EXPORTS | others
    if out.suffix.lower() in (".vtu", ".pvd"):
        return [Output(path, endings, called) for path in series_files(out.with_suffix(".pvd"))]
    return [Output(out, endings, called)]


def _package(ending: str) -> tuple[str, str]:
    from tomoskin.files.exports import export_formats

    return package_of(ending) if ending in EXPORTS else export_formats()[ending].package


@app.command()
def info(file: _File, json: JsonFlag = False) -> None:
    """Show what a session holds: duration, rate, gaps, drops, skin, touches."""
    from tomoskin.files.session import session_info

    with Bar("reading") as bar:
        info = session_info(file, bar)
    tell(asdict(info), (f"{name:<12} {text}" for name, text in _lines(info)), json=json)
    if info.torn and not json:
        remark(f"{file}: {info.torn}")


@app.command()
def repair(
    file: _File,
    out: Annotated[
        Path | None,
        typer.Option(
            metavar="NEW.mcap", help="New file. Default: the file's name with .repaired in it."
        ),
        Writes(RECORDING, _mended),
    ] = None,
    skin: Annotated[
        str | None, typer.Option(help="Built-in name or path, for a file that has lost its skin.")
    ] = None,
    json: JsonFlag = False,
) -> None:
    """Recover every whole chunk of a damaged session into a new file."""
    from tomoskin.files.session import repair
    from tomoskin.model.skin import Skin

    target = _repaired(file, out)
    with Bar("repairing") as bar:
        repaired = repair(file, target, skin=Skin.load(skin) if skin else None, advance=bar)
    frames = repaired.messages.get("/frames", 0)
    line = f"{target}: {repaired.chunks} chunks, {frames} frames recovered; {file} is unchanged"
    tell(asdict(repaired), [line, *_losses(repaired)], json=json)


@app.command()
def split(
    file: Annotated[
        Path, typer.Argument(metavar="FILE", help="Recording of several skins."), Reads()
    ],
    json: JsonFlag = False,
) -> None:
    """Split the recording of several skins into a session file for each skin: FILE-NAME.mcap."""
    from tomoskin.files.session import split, split_targets

    with Bar("splitting") as bar:
        counts = split(file, bar)
    made = split_targets(file)
    lines = (f"{made[name]}: {count} messages" for name, count in counts.items())
    tell({name: str(made[name]) for name in counts}, lines, json=json)


@app.command()
def export(
    file: _File,
    out: Annotated[
        Path,
        typer.Argument(
            metavar="OUT",
            help=f"X{_ENDINGS}.",
        ),
        Writes(EXPORTS, _exported, _package),
    ],
    touches: TouchesOut = None,
    deformations: DeformationsOut = None,
    every: Annotated[
        float, typer.Option(min=1e-3, help="Seconds between two images, for formats with images.")
    ] = 0.1,
    skin: Annotated[
        str, typer.Option(metavar="NAME", help="One skin of a recording of several.")
    ] = "",
    *,
    added: Added,
    force: ForceFlag = False,
) -> None:
    """Convert a session to tables, images or the format of another program."""
    from tomoskin.files.exports import (
        Export,
        export_deformations,
        export_formats,
        export_touches,
        omitted,
    )
    from tomoskin.files.session import SessionReader, skins_in

    form = export_formats()[out.suffix.lower()]
    options: tuple[ExportOptions, ...] = added
    for one in options:
        one.check(out, touches)
    names = (skin,) if skin else skins_in(file)
    if len(names) > 1 and not form.several:
        raise typer.BadParameter(
            f"expected one of {', '.join(names)}, got none", param_hint="--skin"
        )
    with ExitStack() as stack, Bar(f"writing {out}") as bar:
        session, *others = [stack.enter_context(SessionReader(file, name)) for name in names]
        job = Export(session, every, bar, force, tuple(others))
        for one in options:
            job = one.applied(job)
        form.write(job, out)
        if touches is not None:
            export_touches(job, touches)
        if deformations is not None:
            export_deformations(job, deformations)
        if session.torn:
            remark(f"{file}: {session.torn}")
        without = ", ".join(omitted(session, out.suffix.lower()))
    is_series = out.suffix.lower() in (".vtu", ".pvd")  # a .pvd names the files of a series
    for path in (out.with_suffix(".pvd") if is_series else out, touches, deformations):
        if path is not None and path.is_file():
            but = f", without {without}" if without and path == out else ""
            typer.echo(f"{path}: {path.stat().st_size / 1e6:.1f} MB{but}")


@app.command("import")
def import_recording(
    file: Annotated[
        Path,
        typer.Argument(metavar="INPUT", help="Recording in any format that tomoskin reads."),
        Reads(),
    ],
    out: Annotated[
        Path,
        typer.Argument(metavar="OUT.npz", help="Interchange file."),
        Writes({".npz": "an interchange file"}),
    ],
    force: ForceFlag = False,
) -> None:
    """Convert a recording of another program to the interchange file."""
    from tomoskin.files.imports import read_recording, write_interchange

    recording = read_recording(file)
    write_interchange(out, recording, overwrite=force)
    typer.echo(f"{out}: {len(recording)} frames of {len(recording.drive)} rows")
    say_notes(recording)


def _lines(info: SessionInfo) -> list[tuple[str, str]]:
    begun = ""
    if info.begun is not None:
        begun = f", begun {datetime.fromtimestamp(info.begun, UTC):%Y-%m-%d %H:%M:%S} UTC"
    lines = [
        ("file", f"{info.path}, {info.size / 1e6:.2f} MB"),
        ("duration", f"{info.duration:.2f} s{begun}"),
        ("skin", f"{info.skin}: {info.electrodes} electrodes, {info.rows} measurements"),
        ("frames", f"{info.frames}, {info.rate:.1f} frames/s, longest pause "
                   f"{1e3 * info.longest_pause:.0f} ms"),
        ("missing", f"{info.lost} frames in {info.gaps} gaps, {info.dropped} dropped by the "
                    f"board, {info.skipped} skipped, {info.held} held"),
        *_touches(info),
        *(("deformed", line) for line in told_deformations(info.deformations)),
    ]  # fmt: skip
    if info.presses:
        lines.append(("presses", f"{info.presses} on the twin"))
    if info.attached:
        lines.append(("files inside", ", ".join(info.attached)))
    if info.device:
        board, firmware = info.device.get("unique_id"), info.device.get("firmware")
        name = f"{info.device['name']} " if "name" in info.device else ""
        lines.append(("board", f"{name}{board}, firmware {firmware}"))
    if info.clock:
        rate, residual = info.clock.tick_rate, 1e3 * info.clock.residual
        nominal = info.device.get("tick_rate")
        drift = f", {_drift(info.clock.drift(nominal))}" if nominal else ""
        lines.append(
            ("clock", f"{rate:.1f} ticks/s by this host{drift}; frames come {residual:.3f} ms late")
        )
    if info.events:
        counted = ", ".join(f"{kind} {count}" for kind, count in sorted(info.events.items()))
        lines.append(("events", counted))
    return lines


def _touches(info: SessionInfo) -> list[tuple[str, str]]:
    if not (info.touches or info.messages["/image"]):
        return [("touches", "none recorded: tomoskin image finds them")]
    return [("touches", str(info.touches)), *(("", line) for line in span_lines(info.spans))]


def _drift(part: float) -> str:
    """Of the board's clock against ours; the twin's may run much faster than time."""
    if abs(part) > _NO_CLOCK:
        return f"{1 + part:.3g} times the nominal rate: not in real time"
    return f"{1e6 * part:+.1f} ppm"


def _losses(repaired: Repaired) -> list[str]:
    if not repaired.lost:
        return [
            "nothing is lost"
            if repaired.ended
            else ("nothing is lost except the end of the open chunk")
        ]
    return [_loss(lost) for lost in repaired.lost]


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
