"""Which reader a file needs: told by what is in it, not by its name."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from tomoskin.core import DataError
from tomoskin.session import interchange, sixteen
from tomoskin.session.archive import Arrays, load_arrays
from tomoskin.session.recording import Recording

Detect = Callable[[Arrays], bool]
Parse = Callable[[Arrays, str], Recording]

FORMATS: tuple[tuple[Detect, Parse], ...] = (
    (interchange.detects, interchange.parse),
    (sixteen.detects, sixteen.parse),
)
"""What tells a format by its arrays, and what reads it."""


def read_recording(path: Path) -> Recording:
    """Recording in ``path``: an interchange file or a format that can be imported.

    Raises
    ------
    DataError
        When the file cannot be read or is of no known kind; the message lists its keys.
    """
    arrays = load_arrays(path)
    for detects, parse in FORMATS:
        if detects(arrays):
            return parse(arrays, str(path))
    raise DataError(
        f"expected an interchange file (voltages or dv, drive, measure), got the keys "
        f"{', '.join(sorted(arrays)) or 'of an empty archive'}",
        where=str(path),
    )
