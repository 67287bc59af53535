"""``tomoskin session export --like``: a dataset with the rows of a robot's own."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from tomoskin.cli import Reads

if TYPE_CHECKING:
    from tomoskin.files.exports import Export


@dataclass(frozen=True)
class LikeOption:
    """What a dataset takes beside the options of every export."""

    like: Annotated[
        Path | None,
        typer.Option(
            metavar="FOLDER",
            help="Dataset of a robot: X.lerobot has its rate, and its episodes begin at the notes.",
        ),
        Reads(),
    ] = None

    def check(self, out: Path, touches: Path | None) -> None:
        """Raise BadParameter where the output is no dataset."""
        del touches
        if self.like is not None and out.suffix.lower() != ".lerobot":
            raise typer.BadParameter(
                f"expected it together with X.lerobot, got {out}", param_hint="--like"
            )

    def applied(self, job: Export) -> Export:
        """The export with the dataset whose rows are wanted."""
        from tomoskin.extras.lerobot.dataset import Like

        if self.like is None:
            return job
        return replace(job, options=(*job.options, Like(self.like)))
