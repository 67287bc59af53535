"""Which reader a file needs: told by what is in it, not by its name."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from tomoskin.core import DataError
from tomoskin.session import interchange, sixteen
from tomoskin.session.archive import Arrays, load_arrays
from tomoskin.session.mcap import MAGIC
from tomoskin.session.recording import Recording
from tomoskin.session.session_reader import read_session

Detect = Callable[[Arrays], bool]
Parse = Callable[[Arrays, str], Recording]

FORMATS: tuple[tuple[Detect, Parse], ...] = (
    (interchange.detects, interchange.parse),
    (sixteen.detects, sixteen.parse),
)
"""What tells a format by its arrays, and what reads it."""


def read_recording(path: Path) -> Recording:
    """Recording in ``path``: a session, an interchange file or a format that can be imported.

    Raises
    ------
    DataError
        When the file cannot be read or is of no known kind; the message lists its keys.
    """
    if is_session(path):
        return read_session(path)
    arrays = load_arrays(path)
    for detects, parse in FORMATS:
        if detects(arrays):
            return parse(arrays, str(path))
    raise DataError(
        f"expected an interchange file (voltages or dv, drive, measure), got the keys "
        f"{', '.join(sorted(arrays)) or 'of an empty archive'}",
        where=str(path),
    )


def is_session(path: Path) -> bool:
    """Whether the file begins as a session does; DataError when it cannot be read."""
    return _beginning(path) == MAGIC


def _beginning(path: Path) -> bytes:
    try:
        with path.open("rb") as file:
            return file.read(len(MAGIC))
    except FileNotFoundError as error:
        raise DataError("there is no such file", where=str(path)) from error
    except OSError as error:
        raise DataError(f"cannot be read: {error.strerror or error}", where=str(path)) from error
