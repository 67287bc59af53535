"""What all commands write alike: JSON for programs, and files where files can be."""

from __future__ import annotations

from collections.abc import Collection
from pathlib import Path
from typing import Annotated, Any

import typer

from tomoskin.core import DataError

JsonFlag = Annotated[bool, typer.Option("--json", help="Machine-readable output.")]
"""The --json option of a command."""


def emit(document: Any) -> None:
    """Write ``document`` as one line of JSON on stdout, at once."""
    import msgspec

    typer.echo(msgspec.json.encode(document).decode())


def writable(path: Path | None) -> Path | None:
    """Where a file is to go, looked at before the work rather than after it.

    Raises
    ------
    DataError
        When it is a folder, or its folder is not there.
    """
    if path is not None and path.is_dir():
        raise DataError("cannot be written: it is a folder", where=str(path), hint="name a file")
    if path is not None and not path.parent.is_dir():
        raise DataError(
            "cannot be written: there is no such folder", where=str(path), hint="make it first"
        )
    return path


def ending(path: Path, known: Collection[str], option: str) -> str:
    """The ending of a file's name, in small letters.

    Raises
    ------
    typer.BadParameter
        When it is none of those ``known``.
    """
    found = path.suffix.lower()
    if found not in known:
        raise typer.BadParameter(
            f"expected a name that ends in {', '.join(known)}, got {path}", param_hint=option
        )
    return found
