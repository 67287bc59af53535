"""Sources by name, from the entry-point group ``tomoskin.sources``."""

from __future__ import annotations

from collections.abc import Callable
from importlib.metadata import entry_points
from typing import TYPE_CHECKING

from tomoskin.board.source.transport import Transport
from tomoskin.core import SourceError

if TYPE_CHECKING:
    from tomoskin.model.skin import Skin

GROUP = "tomoskin.sources"
"""Entry-point group: each entry is a function ``(argument, skin) -> Transport``."""

Opener = Callable[[str, "Skin"], Transport]


def source_names() -> tuple[str, ...]:
    """Names of the installed sources."""
    return tuple(sorted({entry.name for entry in entry_points(group=GROUP)}))


def open_source(spec: str, skin: Skin) -> Transport:
    """Open ``name`` or ``name:argument``: ``twin``, ``twin:seed=3``, ``serial:/dev/ttyACM0``.

    Raises
    ------
    SourceError
        When there is no source of that name, or it cannot be opened.
    """
    name, _, argument = spec.partition(":")
    for entry in entry_points(group=GROUP, name=name):
        opener: Opener = entry.load()
        return opener(argument, skin)
    names = ", ".join(source_names()) or "none is installed"
    raise SourceError(
        f'expected a source ({names}), got "{name}"', hint="for example twin or serial:PORT"
    )


def read_options(argument: str, known: tuple[str, ...], where: str) -> dict[str, str]:
    """``"seed=3,fast"`` as ``{"seed": "3", "fast": ""}``; SourceError for an unknown word."""
    options = {}
    for item in filter(None, (part.strip() for part in argument.split(","))):
        key, _, value = item.partition("=")
        if key not in known:
            raise SourceError(
                f'expected an option among {", ".join(known)}, got "{key}"', where=where
            )
        options[key] = value
    return options
