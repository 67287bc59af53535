"""The commands, and what becomes of an error: one sentence and an exit code.

To add a command: a module of its name with a function of its name (or a Typer of sub-commands,
``app``) that imports heavy rooms inside, and one line in the list below.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Sequence
from typing import Annotated, NoReturn

import typer

from tomoskin import __version__
from tomoskin.cli.contents import later
from tomoskin.core import OutputError, TomoskinError

DEBUG = "TOMOSKIN_DEBUG"
"""Environment variable: set it to see the traceback of an error."""

COMMANDS = {
    "live": "Show a skin live on a page; without options, the twin of a textile disc.",
    "record": "Record a session without a page: raw bytes, frames, touches and images.",
    "image": "Reconstruct a recording: images, and the touches in them.",
    "calibrate": "Learn from labelled presses, states or bends.",
    "locate": "Locate touches by a calibration.",
    "states": "Tell the state of each frame by a calibration.",
    "design": "Say what a skin can resolve before it is built.",
    "simulate": "Run a script on the twin into a session file, or draw labelled frames.",
    "bench": "Measure speed on this machine.",
    "session": "Inspect, mend and convert recorded sessions.",
    "skin": "List, show, check and lay skins.",
    "firmware": "Build, flash and emulate the board's firmware.",
    "doctor": "Look at this installation: versions, page, sources, sinks, skins, ports.",
}
"""What each command does; :func:`tomoskin.cli.contents.later` says where it is."""

app = typer.Typer(
    help="Touch for soft robots by electrical impedance tomography.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,  # rich alone takes longer to load than all the rest
    context_settings={"help_option_names": ["-h", "--help"]},
    cls=later(COMMANDS),
)


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
    except OutputError as error:
        _fail(str(error), code=2)
    except TomoskinError as error:
        _fail(str(error))
    except Exception as error:
        _fail(
            f"internal error, {type(error).__name__}: {error} "
            f"(set {DEBUG}=1 to see where, and please report it)"
        )
    sys.exit(0)


def _fail(message: str, code: int = 1) -> NoReturn:
    if os.environ.get(DEBUG):
        raise  # noqa: PLE0704 - called while the error is handled
    typer.echo(f"tomoskin: {message}", err=True)
    sys.exit(code)
