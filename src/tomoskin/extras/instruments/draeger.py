"""Dräger's ``.eit`` and ``.get`` files, which are named and not read.

Their binary part has changed with the program, and no description of it says which of its numbers
are voltages and in which units. Guessed ones would look like a recording.
"""

from __future__ import annotations

from pathlib import Path

from tomoskin.core import DataError
from tomoskin.sensing.signal import Recording

_SIGN = b"---Draeger EIT-Software"


def is_draeger(beginning: bytes) -> bool:
    """Whether a file names the program, which newer ones do behind some numbers."""
    return _SIGN in beginning


def read_draeger(path: Path, source: str) -> Recording:
    """Raise DataError that says what can be done."""
    del path
    raise DataError(
        "is a file of Dräger's EIT software, whose layout is not public",
        where=source,
        hint="EIDORS' eidors_readdata reads some versions: vv = eidors_readdata(…); save with "
        "its stimulation as .mat (-v7), which is read here",
    )
