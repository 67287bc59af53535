"""``tomoskin record``: from a source to a session file, without a page."""

from __future__ import annotations

import contextlib
import math
import signal
import threading
from collections.abc import Iterator
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from tomoskin.cli.choices import chosen_sinks, say_headroom, skin_for_source
from tomoskin.cli.named_files import RECORDING, Writes
from tomoskin.cli.options import SinkOption, SkinOption, SourceOption
from tomoskin.cli.output import Bar, JsonFlag, remark, tell
from tomoskin.core import DataError

if TYPE_CHECKING:
    from tomoskin.run import ReplayStatus, Runner

_OFTEN = 0.1
_TROUBLES = frozenset({"no-answer", "source-lost", "silent", "fault", "internal"})
"""Events after which no frames come."""
_STOPPED = frozenset({"recording-stopped", "replay-damaged"})
"""Events with which a recording ends before it is whole."""


def record(
    file: Annotated[
        Path,
        typer.Argument(metavar="FILE", help="A new file, such as run.mcap."),
        Writes(RECORDING),
    ],
    skin: SkinOption = None,
    source: SourceOption = "twin",
    seconds: Annotated[
        float | None,
        typer.Option(help="How long to record. Default: until Ctrl-C or the end of a replay."),
    ] = None,
    frames: Annotated[int | None, typer.Option(min=1, help="Stop after so many frames.")] = None,
    sink: SinkOption = None,
    slow: Annotated[
        int, typer.Option(min=0, help="Say of so many of the slowest frames why they were slow.")
    ] = 0,
    json: JsonFlag = False,
) -> None:
    """Run source and pipeline into a session file until there is enough."""
    from tomoskin.board.source import open_source
    from tomoskin.pipeline import prepare
    from tomoskin.run import Runner

    sinks = chosen_sinks(sink)
    if seconds is not None and not 0 < seconds < math.inf:
        raise typer.BadParameter(f"expected more than 0 s, got {seconds:g}", param_hint="--seconds")
    chosen = skin_for_source(skin, source)
    with Bar("preparing"):
        prepared = prepare(chosen)
        prepared.warm_up()  # else this would take up some of the seconds
    say_headroom(prepared.headroom)
    runner = Runner(prepared, lambda: open_source(source, chosen), sinks=sinks)
    with ended_by_signals(), recording_to(runner, file, frames) as stopped:
        if seconds is None and frames is None and not json:
            typer.echo(f"{runner.flow.source} is recorded to {file}; Ctrl-C ends it", err=True)
        _wait(runner, seconds, frames)
        if (doubt := runner.status().problem) is not None:
            remark(doubt)
    if stopped:
        raise typer.Exit(1)
    status = runner.status()
    if not status.frames:
        raise DataError("no frame arrived, so the recording holds none", where=str(file))
    try:
        size = file.stat().st_size
    except OSError:
        raise DataError(
            "was moved while it was recorded; it is complete where it is now", where=str(file)
        ) from None
    count = status.frames if frames is None else min(status.frames, frames)
    document = {"file": str(file), "bytes": size, "frames": count, "lost": status.gaps,
                "dropped": status.dropped, "corrupt": status.corrupt}  # fmt: skip
    lines = [f"{file}: {count} frames, {size / 1e6:.1f} MB, {status.gaps} lost"]
    if slow:
        document["slowest"] = [asdict(cost) for cost in status.slowest[:slow]]
        lines += [f"frame {cost.sequence:>6}  {cost.text}" for cost in status.slowest[:slow]]
    tell(document, lines, json=json)


@contextlib.contextmanager
def ended_by_signals() -> Iterator[None]:
    """Ctrl-C and SIGTERM end the block, wherever it stands: that is no failure."""
    before = signal.signal(signal.SIGTERM, signal.default_int_handler)
    try:
        with contextlib.suppress(KeyboardInterrupt):
            yield
    finally:
        signal.signal(signal.SIGTERM, before)


@contextlib.contextmanager
def recording_to(
    runner: Runner, file: Path | None, frames: int | None = None
) -> Iterator[list[str]]:
    """The runner runs while the block lasts, and records from its first byte to ``file``, at most
    so many ``frames``.

    The list says why recordings have ended by themselves; it is whole after the block.
    """
    from tomoskin.run import commands

    if file is not None:
        runner.ask(commands.Record(file, frames=frames))
    try:
        runner.start()
    except BaseException:
        runner.stop()
        if file is not None:
            file.unlink(missing_ok=True)
        raise
    with troubles_told(runner) as stopped:
        try:
            yield stopped
        finally:
            runner.stop()


@contextlib.contextmanager
def troubles_told(runner: Runner, name: str = "") -> Iterator[list[str]]:
    """While the block lasts, say on stderr why no frames come, when they come again, and why a
    recording has ended; the list holds the last. ``name`` is of one skin among several."""
    ended, stopped = threading.Event(), list[str]()

    def tell() -> None:
        number, troubled, last = 0, False, False
        while not last:
            last = ended.wait(_OFTEN)
            number, happened = runner.events.since(number)
            for event in happened:
                if event.kind in _STOPPED:
                    stopped.append(event.text)
                    remark(name + event.text)
                elif event.kind in _TROUBLES or (troubled and event.kind == "connected"):
                    remark(name + event.text)
                    troubled = event.kind in _TROUBLES

    thread = threading.Thread(target=tell, name="troubles", daemon=True)
    thread.start()
    try:
        yield stopped
    finally:
        ended.set()
        thread.join()


def _wait(runner: Runner, seconds: float | None, frames: int | None) -> None:
    """Until there is enough, a replay or the recording has ended by itself, or a signal comes."""
    nothing = threading.Event()
    elapsed = 0.0
    with Bar("recording") as bar:
        while (flow := runner.flow).out.recordings.path is not None:
            shares = [
                (elapsed, seconds),
                (flow.out.recordings.frames, frames),
                *_played(flow.played),
            ]
            limits = [(part, limit) for part, limit in shares if limit is not None]
            for part, limit in limits:
                if part >= limit:
                    return
            for part, limit in limits[:1]:
                bar(part, limit)
            nothing.wait(_OFTEN if seconds is None else min(_OFTEN, seconds - elapsed))
            elapsed += _OFTEN


def _played(replay: ReplayStatus | None) -> list[tuple[float, float | None]]:
    """How far a replay is, if that is known: not of one that begins again at its end."""
    if replay is None or replay.loop:
        return []
    if replay.end_s <= 0 and not replay.ended:
        return []  # a file without its end says how long it is only as it is played
    reached = replay.end_s if replay.ended else min(replay.now_s, 0.99 * replay.end_s)
    return [(reached, replay.end_s)]
