"""Which reader a file needs: what is in it decides, not its name."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import islice
from pathlib import Path
from typing import Any, Literal

import numpy as np

from tomoskin.core import (
    EMPTY,
    MAGIC,
    Arrays,
    DataError,
    StrPath,
    load_arrays,
    open_input,
    registered,
)
from tomoskin.files.imports import interchange
from tomoskin.files.imports.text_lines import bytes_lines, text_lines
from tomoskin.files.session import read_session
from tomoskin.sensing.signal import Recording


@dataclass(frozen=True)
class Format:
    """A format of recordings; others than these are registered at the seam "readers".

    Attributes
    ----------
    name
        Whose files they are, in words.
    kind
        What it is known by, and made of. "arrays": by the arrays of an archive, made of these.
        "text": by a list of its first lines, made of all lines. "file": by its first bytes, made of
        its path; then it may also give arrays, which are taken for an archive's.
    detects
        Whether something is of this format.
    parse
        The recording in it, whose source is named; or arrays.
    """

    name: str
    kind: Literal["file", "arrays", "text"]
    detects: Callable[[Any], bool]
    parse: Callable[[Any, str], Recording | Arrays]


FORMATS = (
    Format("an interchange file", "arrays", interchange.detects, interchange.parse),
    Format("a table of voltages", "text", interchange.is_table, interchange.read_table),
)
"""Those that are looked for first."""

_HEAD = 128
_FIRST_LINES = 300
_ZIP = (b"PK\x03\x04", b"PK\x05\x06")
_HDF5 = b"\x89HDF"
_PICKLE = b"\x80"


def read_recording(path: StrPath) -> Recording:
    """Recording in ``path``: a session, an interchange file or a format that can be imported.

    Absurd values are excluded; its notes name them.

    Raises
    ------
    DataError
        When the file cannot be read or is of no known kind; the message lists its keys.
    """
    return _read(Path(path)).plausible().steady()


def _read(path: Path) -> Recording:
    head = _beginning(path)
    if head.startswith(MAGIC):
        return read_session(path)
    if (made := _parsed("file", head, path, str(path))) is not None:
        return made if isinstance(made, Recording) else _from_arrays(made, path)
    if head.startswith(_ZIP):
        return _from_arrays(load_arrays(path), path)
    return _from_text(head, path)


def is_session(path: StrPath) -> bool:
    """Whether the file begins as a session does; DataError when it cannot be read."""
    return _beginning(Path(path)).startswith(MAGIC)


def _from_arrays(arrays: Arrays, path: Path) -> Recording:
    recording = _parsed("arrays", arrays, arrays, str(path))
    if recording is None and set(arrays) == {"raw"} and arrays["raw"].dtype == np.uint8:
        lines = list(bytes_lines(arrays["raw"].tobytes()))
        recording = _parsed("text", lines[:_FIRST_LINES], lines, str(path))
    if isinstance(recording, Recording):
        return recording
    raise DataError(
        f"expected an interchange file (voltages or dv, drive, measure), got the keys "
        f"{', '.join(sorted(arrays)) or 'of an empty archive'}",
        where=str(path),
        hint="docs/interchange.md lists what can be read",
    )


def _from_text(head: bytes, path: Path) -> Recording:
    if head.startswith(_HDF5):
        raise DataError(
            "is an HDF5 file, or a MATLAB file of version 7.3",
            where=str(path),
            hint="save it with -v7, or as .npz",
        )
    if head.startswith(_PICKLE):
        raise DataError(
            "looks like a pickle; tomoskin never reads pickles, because they can run any program",
            where=str(path),
            hint="save plain arrays as .npz",
        )
    first = list(islice(text_lines(path), _FIRST_LINES))
    recording = _parsed("text", first, text_lines(path), str(path))
    if isinstance(recording, Recording):
        return recording
    names = ", ".join(dict.fromkeys(known.name for known in _formats()))
    raise DataError(
        f"is not a complete .npz archive, a session, {names}",
        where=str(path),
        hint="docs/interchange.md lists what can be read",
    )


def _formats() -> Iterator[Format]:
    """Ours, then those that are registered."""
    yield from FORMATS
    yield from (entry.load() for entry in registered("readers").values())


def _parsed(kind: str, head: object, content: object, source: str) -> Recording | Arrays | None:
    """What the first format of a ``kind`` that knows the ``head`` makes of the content."""
    some = (known for known in _formats() if known.kind == kind)
    known = next((known for known in some if known.detects(head)), None)
    return None if known is None else known.parse(content, source)


def _beginning(path: Path) -> bytes:
    with open_input(path) as file:
        if head := file.read(_HEAD):
            return head
    raise DataError(EMPTY, where=str(path))
