"""The commands, and what becomes of an error: one sentence and an exit code.

To add a command: a module with a function (or a Typer of sub-commands) that imports heavy rooms
inside, and one line in the list below.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Sequence
from typing import Annotated, NoReturn

import typer

from tomoskin import __version__
from tomoskin.cli import (
    bench,
    calibrate,
    design,
    doctor,
    firmware,
    image,
    live,
    locate,
    record,
    session,
    simulate,
    skin,
    states,
)
from tomoskin.core import TomoskinError

DEBUG = "TOMOSKIN_DEBUG"
"""Environment variable: set it to see the traceback of an error."""

app = typer.Typer(
    help="Touch for soft robots by electrical impedance tomography.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,  # rich alone takes longer to load than all the rest
    context_settings={"help_option_names": ["-h", "--help"]},
)
app.command("live")(live.live)
app.command("record")(record.record)
app.command("image")(image.image)
app.add_typer(calibrate.app, name="calibrate")
app.command("locate")(locate.locate)
app.command("states")(states.states)
app.command("design")(design.design)
app.command("simulate")(simulate.simulate)
app.command("bench")(bench.bench)
app.add_typer(session.app, name="session")
app.add_typer(skin.app, name="skin")
app.add_typer(firmware.app, name="firmware")
app.command("doctor")(doctor.doctor)


def _show_version(wanted: bool) -> None:
    if wanted:
        typer.echo(f"tomoskin {__version__}")
        raise typer.Exit


@app.callback()
def _options(
    version: Annotated[
        bool,
        typer.Option(
            "--version", callback=_show_version, is_eager=True, help="Show the version and exit."
        ),
    ] = False,
) -> None:
    """Say what the command as a whole takes."""


def main(arguments: Sequence[str] | None = None) -> NoReturn:
    """Run a command and exit: 0 done, 1 failed, 2 wrong usage."""
    try:
        app(args=None if arguments is None else list(arguments), prog_name="tomoskin")
    except TomoskinError as error:
        _fail(str(error))
    except Exception as error:
        _fail(
            f"internal error, {type(error).__name__}: {error} "
            f"(set {DEBUG}=1 to see where, and please report it)"
        )
    sys.exit(0)


def _fail(message: str) -> NoReturn:
    if os.environ.get(DEBUG):
        raise  # noqa: PLE0704 - called while the error is handled
    typer.echo(f"tomoskin: {message}", err=True)
    sys.exit(1)
