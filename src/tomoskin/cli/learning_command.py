"""The commands ``tomoskin calibrate KIND`` of every kind: what they share."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any, get_type_hints

import typer

from tomoskin.cli.named_files import ForceFlag, Reads, with_options
from tomoskin.cli.named_parts import Recorded
from tomoskin.cli.options import CalibrationOut, ReferenceOption, SkinOption
from tomoskin.cli.output import JsonFlag, tell
from tomoskin.core import DataError


@dataclass(frozen=True)
class LearningOutcome:
    """What came of it: ``write`` makes the file, ``facts`` and ``lines`` say it to programs and to
    people; a ``problem`` is raised at the end."""

    write: Callable[..., None] | None
    facts: dict[str, Any]
    lines: list[str] = field(default_factory=list)
    problem: DataError | None = None


Learn = Callable[..., LearningOutcome]


def calibration_command(
    about: str, skin: Any = SkinOption, out: Any = CalibrationOut
) -> Callable[[Learn], Callable[..., None]]:
    """Make a command of a function that learns, whose input is ``about`` something; a decorator.

    The function's first parameter is what was recorded, the others are options that its command
    alone has. ``skin`` and ``out`` are the annotations of those that all have.
    """

    def of(learn: Learn) -> Callable[..., None]:
        def command(
            recording: Path,
            out: Path,
            skin: str | None,
            reference: str | None,
            force: bool,
            json: bool,
            **own: Any,
        ) -> None:
            outcome = learn(Recorded.of(recording, skin, reference, needs_skin=needs_skin), **own)
            if outcome.write is not None:
                outcome.write(out, overwrite=force)
            tell(outcome.facts, outcome.lines, json=json)
            if outcome.problem is not None:
                raise outcome.problem

        needs_skin = skin is SkinOption
        hints, needed = get_type_hints(learn, include_extras=True), inspect.Parameter.empty
        own = list(inspect.signature(learn).parameters.values())[1:]
        argument = Annotated[Path, typer.Argument(metavar="INPUT", help=about), Reads()]
        options = {
            "recording": (argument, needed),
            "out": (out, needed),
            "skin": (skin, None),
            **{one.name: (hints[one.name], one.default) for one in own},
            "reference": (ReferenceOption, None),
            "force": (ForceFlag, False),
            "json": (JsonFlag, False),
        }
        return with_options(command, learn, options)

    return of
