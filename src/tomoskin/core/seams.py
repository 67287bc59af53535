"""Seams: where an extra, or a package of a user's own, adds something to the core by its name.

An extra is a folder of :mod:`tomoskin.extras` with a table ``extra.toml``. Each section is a seam,
each line in it a name and ``module:attribute``, where the module is one of the extra's own; a
table in its place has this as its ``target``, and ``about`` it a sentence that is shown without
loading it. A line
``uses = ["NAME"]`` at the table's top names the extras that it cannot do without.

Another package says the same by entry points of the group ``tomoskin.SEAM``. The core asks for what
is registered at a seam, and names no extra.
"""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from importlib import import_module
from pathlib import Path
from typing import Any, Literal, get_args

from tomoskin.core.errors import DataError, no_such

Seam = Literal[
    "sources",  # (argument, skin) -> Transport
    "loads",  # (argument, transfer resistances, current) -> a context of the Transport of a board
    "sinks",  # argument -> Sink
    "skins",  # a pathlib.Path of a skin file
    "methods",  # a tomoskin.imaging.Method
    "readers",  # a tomoskin.files.imports.Format
    "exports",  # ".ending" of a session's files: a tomoskin.files.exports.ExportFormat
    "calibrations",  # a tomoskin.learning.Kind
    "commands",  # a function of a command, or of "command sub-command"; or typer's app of several
    "options",  # a record of options that are added to the "command NAME"
    "flows",  # a class of tomoskin.server.GuidedFlow
]
"""Where something can be added, and what it is."""

PREFIX = "tomoskin."
"""Of the groups of entry points that are seams."""

TABLE = "extra.toml"
"""Name of an extra's table, which stands in its folder."""

USES = "uses"
"""Key of that table: the other extras that this one imports."""


@dataclass(frozen=True)
class Registered:
    """What one ``name`` stands for: an attribute of a module, such as ``"package.module:thing"``.

    ``extra`` is the folder that it comes from, "" where an installed package brings it; ``about``
    is what its table says of it.
    """

    name: str
    target: str
    extra: str = ""
    about: str = ""

    def load(self) -> Any:
        """The thing itself. Raises what the import of its module raises."""
        module, _, path = self.target.partition(":")
        thing: Any = import_module(module)
        for part in path.split("."):
            thing = getattr(thing, part)
        return thing


def registered(seam: Seam) -> Mapping[str, Registered]:
    """What is registered at a ``seam``, by name: extras in their order, then other packages."""
    from importlib.metadata import entry_points  # noqa: PLC0415 - loads slowly

    entries = {entry.name: entry for entry in _of_extras()[seam]}
    for entry in entry_points(group=f"{PREFIX}{seam}"):
        entries.setdefault(entry.name, Registered(entry.name, entry.value))
    return entries


def registered_one(seam: Seam, name: str) -> Registered | None:
    """What is registered at a ``seam`` as ``name``; None where nothing is."""
    ours = next((entry for entry in _of_extras()[seam] if entry.name == name), None)
    return ours or registered(seam).get(name)


def extra_names() -> tuple[str, ...]:
    """The extras that are here, in alphabetical order."""
    return tuple(file.parent.name for file in _tables())


@cache
def _of_extras() -> Mapping[Seam, tuple[Registered, ...]]:
    entries_of: dict[Seam, list[Registered]] = {seam: [] for seam in get_args(Seam)}
    for file in _tables():
        extra = file.parent.name
        for seam, entries in _read(file).items():
            for name, entry in entries.items():
                target, about = entry, ""
                if not isinstance(entry, str):
                    target, about = entry["target"], entry.get("about", "")
                where = f"tomoskin.extras.{extra}.{target}"
                entries_of[seam].append(Registered(name, where, extra, about))
    return {seam: tuple(entries) for seam, entries in entries_of.items()}


def _tables() -> list[Path]:
    return sorted((Path(__file__).parent.parent / "extras").glob(f"*/{TABLE}"))


def _read(file: Path) -> dict[Seam, dict[str, Any]]:
    """The sections of an extra's table. Raises DataError for a section that is no seam."""
    table: dict[Any, Any] = tomllib.loads(file.read_text(encoding="utf-8"))
    table.pop(USES, None)
    for section in table:
        if section not in get_args(Seam):
            raise DataError(no_such(section, get_args(Seam), "a seam"), where=str(file))
    return table
