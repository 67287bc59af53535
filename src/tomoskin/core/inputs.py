"""Opening the files of a user for reading."""

from __future__ import annotations

from pathlib import Path
from typing import BinaryIO

from tomoskin.core.errors import DataError
from tomoskin.core.outputs import StrPath


def check_is_file(path: StrPath) -> None:
    """Raise DataError where ``path`` is no ordinary file: a pipe or a device may never end."""
    path = Path(path)
    try:
        if not path.exists():
            raise DataError("there is no such file", where=str(path))
        if path.is_dir():
            raise DataError("is a folder, not a file", where=str(path))
        if not path.is_file():
            raise DataError(
                "is a pipe or a device, not a file",
                where=str(path),
                hint="copy what comes out of it into a file",
            )
    except (OSError, ValueError) as error:  # a name that is too long, or has a zero byte
        reason = getattr(error, "strerror", None) or str(error)
        raise DataError(f"cannot be read: {reason}", where=str(path)[:80]) from error


def open_input(path: StrPath, buffering: int = -1) -> BinaryIO:
    """An ordinary file, open for reading bytes.

    Raises
    ------
    DataError
        When it is missing, a folder, a pipe or a device, or cannot be read.
    """
    check_is_file(path)
    try:
        return Path(path).open("rb", buffering=buffering)
    except OSError as error:
        raise DataError(f"cannot be read: {error.strerror or error}", where=str(path)) from error
