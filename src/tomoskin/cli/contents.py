"""A list of commands that says what each does in whole sentences, and loads the one that runs."""

from __future__ import annotations

from importlib import import_module
from typing import Any

import typer
from typer.core import TyperGroup

from tomoskin.cli.named_files import guarded


class Commands(typer.Typer):
    """Commands whose outputs are looked at before they run."""

    def command(self, name: str | None = None, **options: Any) -> Any:
        """Add a command, as a decorator that leaves the function as it is."""
        register = super().command(name, **options)

        def add(function: Any) -> Any:
            register(guarded(function))
            return function

        return add


class Contents(TyperGroup):
    """Commands with whole sentences: too long ones go on in the next line."""

    def format_commands(self, ctx: Any, formatter: Any) -> None:
        """Write names and sentences."""
        with formatter.section("Commands"):
            formatter.write_dl([(name, self.sentence(ctx, name)) for name in self.commands])

    def sentence(self, ctx: Any, name: str) -> str:
        """What the command does: the first paragraph of its help."""
        command = self.get_command(ctx, name)
        first = ((command and command.help) or "").partition("\n\n")[0]
        return " ".join(first.split())


def later(sentences: dict[str, str]) -> type[Contents]:
    """Make a list of commands by name, of which each is loaded when it runs.

    The command NAME is ``app`` of the module ``tomoskin.cli.NAME`` where there is one, else its
    function NAME.
    """

    class Later(Contents):
        def __init__(self, **options: Any) -> None:
            super().__init__(**options)
            names: dict[str, Any] = dict.fromkeys(sentences)
            self.commands = names

        def sentence(self, ctx: Any, name: str) -> str:  # noqa: ARG002
            return sentences[name]

        def get_command(self, ctx: Any, cmd_name: str) -> Any:  # noqa: ARG002
            return _loaded(cmd_name) if cmd_name in sentences else None

    return Later


def _loaded(name: str) -> Any:
    module = import_module(f"tomoskin.cli.{name}")
    if (group := getattr(module, "app", None)) is not None:
        return typer.main.get_command(group)
    single = Commands(add_completion=False, rich_markup_mode=None)
    single.command(name)(getattr(module, name))
    return typer.main.get_command(single)


def group(help: str) -> typer.Typer:
    """Make a command of sub-commands that stand in it in whole sentences."""
    return Commands(
        help=help,
        no_args_is_help=True,
        add_completion=False,
        rich_markup_mode=None,
        cls=Contents,
    )
