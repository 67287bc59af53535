"""The commands: a list in whole sentences, of which the one that runs is loaded; and what becomes
of an error: one sentence and an exit code.

To add a command: a module of its name with a function of its name (or sub-commands, ``app``, made
by :func:`group`) that imports heavy rooms inside, and its sentence in the list below. Extras and
other packages register theirs at the seam "commands", whose sentence is the first of their
docstring: as ``NAME``, or as ``"GROUP NAME"`` where it is a sub-command.
"""

from __future__ import annotations

import inspect
import io
import os
import sys
from collections.abc import Sequence
from importlib import import_module
from typing import Annotated, Any, NoReturn

import typer
from typer.core import TyperGroup

from tomoskin import __version__
from tomoskin.cli.named_files import guarded, spread
from tomoskin.core import OutputError, TomoskinError, registered, registered_one

DEBUG = "TOMOSKIN_DEBUG"
"""Environment variable: set it to see the traceback of an error."""

COMMANDS = {
    "live": "Show a skin live on a page; the default is the twin of a textile disc.",
    "record": "Record a session without a page: raw bytes, frames, touches and images.",
    "image": "Reconstruct a recording: images and touches.",
    "explain": "Say how one frame of a session became touches, step by step.",
    "calibrate": "Learn a calibration from labelled examples.",
    "locate": "Locate touches with a calibration: one per frame, or up to two with --several.",
    "simulate": "Run a script on the twin into a session file.",
    "bench": "Measure speed on this machine.",
    "session": "Show, repair and convert recorded sessions.",
    "skin": "List, show and check skins, and lay them on surfaces.",
    "board": "Check a newly built board before a skin is connected.",
    "doctor": "Check this installation: versions, page, sources, sinks, skins, ports.",
}
"""What each command does: a function NAME of the module ``tomoskin.cli.NAME``, or its ``app``."""


class Commands(typer.Typer):
    """Commands whose outputs are looked at before they run."""

    def command(self, name: str | None = None, **options: Any) -> Any:
        """Add a command, as a decorator that leaves the function as it is."""
        register = super().command(name, **options)

        def add(function: Any) -> Any:
            of = " ".join(filter(None, (self.info.name, name or function.__name__)))
            register(guarded(spread(function, of)))
            return function

        return add


class Contents(TyperGroup):
    """Commands with whole sentences: too long ones go on in the next line."""

    def __init__(self, **options: Any) -> None:
        super().__init__(**options)
        names = [_inside(self.name or "", name) for name in registered("commands")]
        later: dict[str, Any] = dict.fromkeys(filter(None, names))
        self.commands = {**self.commands, **later}

    def format_commands(self, ctx: Any, formatter: Any) -> None:
        """Write the commands with a sentence each."""
        with formatter.section("Commands"):
            formatter.write_dl([(name, self.sentence(ctx, name)) for name in self.commands])

    def sentence(self, ctx: Any, name: str) -> str:
        """What the command does: what its table says, or the first paragraph of its help."""
        if about := _about(f"{self.name} {name}" if self.name in COMMANDS else name):
            return about
        command = self.get_command(ctx, name)
        first = ((command and command.help) or "").partition("\n\n")[0]
        return " ".join(first.split())

    def get_command(self, ctx: Any, cmd_name: str) -> Any:
        """The command, one that was registered loaded now; None where there is none."""
        if self.commands.get(cmd_name) is None and cmd_name in self.commands:
            self.commands[cmd_name] = _added(f"{self.name} {cmd_name}")
        return super().get_command(ctx, cmd_name)


def _inside(group: str, name: str) -> str:
    """What a registered command is called in a ``group``; "" where it is of another one."""
    first, _, second = name.rpartition(" ")
    return second if first == group else ""


class Later(Contents):
    """The commands of :data:`COMMANDS` and those that are registered, each loaded when it runs."""

    def __init__(self, **options: Any) -> None:
        TyperGroup.__init__(self, **options)
        names: dict[str, Any] = dict.fromkeys(COMMANDS)
        self.commands = names

    def list_commands(self, ctx: Any) -> list[str]:  # noqa: ARG002
        """All names, for a list or a mistyped one."""
        return [*COMMANDS, *(name for name in registered("commands") if " " not in name)]

    def format_commands(self, ctx: Any, formatter: Any) -> None:
        """Write the commands with a sentence each."""
        names: dict[str, Any] = dict.fromkeys(self.list_commands(ctx))
        self.commands = names
        super().format_commands(ctx, formatter)

    def sentence(self, ctx: Any, name: str) -> str:
        """What the command does, without loading it where the core has it."""
        return COMMANDS.get(name) or super().sentence(ctx, name)

    def get_command(self, ctx: Any, cmd_name: str) -> Any:  # noqa: ARG002
        """The command, or None where there is none of that name."""
        return _loaded(cmd_name) if cmd_name in COMMANDS else _added(cmd_name)


def _loaded(name: str) -> Any:
    module = import_module(f"tomoskin.cli.{name}")
    if (group := getattr(module, "app", None)) is not None:
        return typer.main.get_command(group)
    function = getattr(module, name)
    _, _, more = (function.__doc__ or "").partition("\n\n")
    return _single(name, function, f"{COMMANDS[name]}\n\n{inspect.cleandoc(more)}")


def _added(name: str) -> Any:
    """A command that is registered, by its name with its group's; None where none is."""
    entry = registered_one("commands", name)
    if entry is None:
        return None
    command = entry.load()
    if isinstance(command, typer.Typer):
        return typer.main.get_command(command)
    text = inspect.getdoc(command) or ""
    if entry.about:
        text = f"{entry.about}\n\n{text.partition(chr(10) * 2)[2]}"
    return _single(name, command, text)


def _about(name: str) -> str:
    """What the table of a registered command says of it; "" where it says nothing."""
    entry = registered_one("commands", name)
    return entry.about if entry else ""


def _single(name: str, function: Any, text: str) -> Any:
    group, _, own = name.rpartition(" ")
    single = Commands(name=group or None, add_completion=False, rich_markup_mode=None)
    single.command(own, help=text)(function)
    return typer.main.get_command(single)


def group(name: str, about: str = "") -> typer.Typer:
    """Make the command ``name`` of sub-commands, which is ``about`` something."""
    return Commands(
        name=name,
        help=about or COMMANDS[name],
        no_args_is_help=True,
        add_completion=False,
        rich_markup_mode=None,
        cls=Contents,
    )


app = typer.Typer(
    help="Touch for soft robots by electrical impedance tomography.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,  # rich alone takes longer to load than all the rest
    context_settings={"help_option_names": ["-h", "--help"]},
    cls=Later,
)


def _show_version(show: bool) -> None:
    if show:
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
    _write_any_name()
    try:
        app(args=None if arguments is None else list(arguments), prog_name="tomoskin")
    except OutputError as error:
        _fail(str(error), code=2)
    except TomoskinError as error:
        _fail(str(error))
    except MemoryError as error:
        _fail(
            f"this machine has too little memory for that{error and f': {error}'} "
            "(take a part of the recording, or a larger machine)"
        )
    except Exception as error:
        _fail(
            f"internal error, {type(error).__name__}: {error} "
            f"(set {DEBUG}=1 to see where, and please report it)"
        )
    sys.exit(0)


def _write_any_name() -> None:
    """Let stdout take names of files that are no text, as stderr does."""
    if isinstance(sys.stdout, io.TextIOWrapper) and sys.stdout.errors == "strict":
        sys.stdout.reconfigure(errors="backslashreplace")


def _fail(message: str, code: int = 1) -> NoReturn:
    if os.environ.get(DEBUG):
        raise  # noqa: PLE0704 - called while the error is handled
    typer.echo(f"tomoskin: {message}", err=True)
    sys.exit(code)
