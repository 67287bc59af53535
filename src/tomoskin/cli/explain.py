"""``tomoskin explain``: one frame of a session, step by step from counts to touches."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from tomoskin.cli.named_files import Reads
from tomoskin.cli.output import Bar, JsonFlag, tell
from tomoskin.core import DataError


def explain(
    session: Annotated[Path, typer.Argument(metavar="SESSION", help="Session file."), Reads()],
    frame: Annotated[
        int, typer.Option(min=0, metavar="N", help="Number of the frame, counted from 0.")
    ],
    touch: Annotated[
        int | None,
        typer.Option(
            min=1, metavar="ID", help="Only why this touch began, stayed, moved or ended."
        ),
    ] = None,
    skin: Annotated[
        str, typer.Option(metavar="NAME", help="One skin of a robot's recording.")
    ] = "",
    json: JsonFlag = False,
) -> None:
    """Say each record of the frame with shapes and units, which explanations of it were compared,
    and in a sentence each why touches began, stayed, moved, ended or did not begin.
    """
    from tomoskin.files.session import SessionReader, explain as explained

    with Bar("replaying"), SessionReader(session, skin) as reader:
        explanation = explained(reader, frame)
    lines = list(explanation.lines)
    if touch is not None:
        lines = list(explanation.of_touch(touch))
        if not lines:
            raise DataError(
                f"expected a touch of frame {frame}, got {touch}: nothing was decided of it there",
                where=str(session),
                hint="leave --touch out to see all that the frame holds",
            )
    steps = [{"step": step.name, "lines": step.lines} for step in explanation.steps]
    tell({"frame": frame, "time_s": explanation.time, "steps": steps}, lines, json=json)
