"""Which reader a file needs: told by what is in it, not by its name."""

from __future__ import annotations

from pathlib import Path

from tomoskin.core import DataError
from tomoskin.session import interchange, sixteen
from tomoskin.session.archive import load_arrays
from tomoskin.session.recording import Recording

FORMATS = (interchange, sixteen)
"""Each has ``detects(arrays)`` and ``parse(arrays, source)``."""


def read_recording(path: Path) -> Recording:
    """Recording in ``path``: an interchange file or a format that can be imported.

    Raises
    ------
    DataError
        When the file cannot be read or is of no known kind; the message lists its keys.
    """
    arrays = load_arrays(path)
    for kind in FORMATS:
        if kind.detects(arrays):
            return kind.parse(arrays, str(path))
    raise DataError(
        f"expected an interchange file (voltages or dv, drive, measure), got the keys "
        f"{', '.join(sorted(arrays)) or 'of an empty archive'}",
        where=str(path),
    )
