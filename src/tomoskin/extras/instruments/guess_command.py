"""``tomoskin skin guess``, and what ``tomoskin image`` says of the order of electrodes."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from tomoskin.cli import SKIN, ForceFlag, ImageOptions, RecordingArgument, Writes
from tomoskin.core import write_text

if TYPE_CHECKING:
    from tomoskin.pipeline import Prepared
    from tomoskin.sensing.signal import Recording


def guess(
    recording: RecordingArgument,
    out: Annotated[
        Path | None,
        typer.Option(metavar="X.toml", help="File for the skin. Default: it is printed."),
        Writes(SKIN),
    ] = None,
    force: ForceFlag = False,
) -> None:
    """Write a skin file for a recording of another board; comments say what is sure in it."""
    from tomoskin.extras.instruments.guess import guess_skin
    from tomoskin.files.imports import read_recording

    text = guess_skin(read_recording(recording))
    if out is None:
        typer.echo(text)
        return
    write_text(out, text, overwrite=force)
    typer.echo(f"{out}: check its comments; next: tomoskin image {recording} --skin {out}")


@dataclass(frozen=True)
class Order(ImageOptions):
    """Electrodes of another board's file that seem to stand in another order."""

    def doubts(self, recording: Recording, prepared: Prepared) -> Iterator[str]:
        """What to check in the file's tables, or nothing."""
        from tomoskin.extras.instruments.guess import order_fault

        if recording.board_known:
            return
        resistance = prepared.model.transfer_resistance(prepared.skin.conductivity)
        if fault := order_fault(recording, resistance):
            yield (
                f"{recording.source}: {fault}: check its tables, or say where each electrode is "
                "by positions in [electrodes] of the skin file"
            )
