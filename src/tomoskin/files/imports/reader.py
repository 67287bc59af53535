"""Which reader a file needs: what is in it decides, not its name."""

from __future__ import annotations

from collections.abc import Callable
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np
from scipy.io.matlab import MatlabObject, MatlabOpaque

from tomoskin.core import EMPTY, MAGIC, Arrays, DataError, StrPath, load_arrays, open_input
from tomoskin.files.imports import interchange, matrices, sixteen, text_logs
from tomoskin.files.imports.matlab import is_eidors, is_matlab, load_matlab, read_eidors
from tomoskin.files.imports.text_logs import bytes_lines, text_lines
from tomoskin.files.session import read_session
from tomoskin.sensing.signal import Recording

Format = tuple[Callable[[Any], bool], Callable[[Any, str], Recording]]

ARRAY_FORMATS: tuple[Format, ...] = (
    (interchange.detects, interchange.parse),
    (sixteen.detects, sixteen.parse),
    (matrices.is_eskin, matrices.read_eskin),
    (matrices.is_ktc, matrices.read_ktc),
    (matrices.is_pyeit, matrices.read_pyeit),
)
"""What recognises a format by its arrays, and what reads it."""

TEXT_FORMATS: tuple[Format, ...] = (
    (interchange.is_table, interchange.read_table),
    (text_logs.is_open_eit, text_logs.read_open_eit),
    (text_logs.is_eit_kit, text_logs.read_eit_kit),
    (text_logs.is_sciospec, text_logs.read_sciospec),
    (text_logs.is_serial_log, text_logs.read_serial_log),
)
"""The same for text, by its first lines."""

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
    if is_matlab(head):
        return _from_matlab(load_matlab(path), path)
    if head.startswith(_ZIP):
        return _from_arrays(load_arrays(path), path)
    return _from_text(head, path)


def is_session(path: StrPath) -> bool:
    """Whether the file begins as a session does; DataError when it cannot be read."""
    return _beginning(Path(path)).startswith(MAGIC)


def _from_arrays(arrays: Arrays, path: Path) -> Recording:
    recording = _parsed(ARRAY_FORMATS, arrays, arrays, str(path))
    if recording is None and set(arrays) == {"raw"} and arrays["raw"].dtype == np.uint8:
        lines = list(bytes_lines(arrays["raw"].tobytes()))
        recording = _parsed(TEXT_FORMATS, lines[:_FIRST_LINES], lines, str(path))
    if recording is not None:
        return recording
    raise DataError(
        f"expected an interchange file (voltages or dv, drive, measure), got the keys "
        f"{', '.join(sorted(arrays)) or 'of an empty archive'}",
        where=str(path),
        hint="docs/interchange.md lists what can be read",
    )


def _from_matlab(variables: dict[str, Any], path: Path) -> Recording:
    if is_eidors(variables):
        return read_eidors(variables, str(path))
    if objects := [k for k, v in variables.items() if isinstance(v, MatlabObject | MatlabOpaque)]:
        raise DataError(
            f"holds MATLAB objects ({', '.join(objects)}), which only MATLAB can read",
            where=str(path),
            hint='in MATLAB: s = struct(object); save("plain.mat", "-struct", "s", "-v7")',
        )
    arrays = {
        key: value
        for key, value in variables.items()
        if isinstance(value, np.ndarray) and value.dtype.kind in "biufc"
    }
    return _from_arrays(arrays, path)


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
    recording = _parsed(TEXT_FORMATS, first, text_lines(path), str(path))
    if recording is not None:
        return recording
    raise DataError(
        "is not a complete .npz archive, a session, a MATLAB file or a known text log",
        where=str(path),
        hint="docs/interchange.md lists what can be read",
    )


def _parsed(
    formats: tuple[Format, ...], head: object, content: object, source: str
) -> Recording | None:
    """What the first of the ``formats`` that knows the ``head`` makes of the content."""
    reader = next((parse for detects, parse in formats if detects(head)), None)
    return None if reader is None else reader(content, source)


def _beginning(path: Path) -> bytes:
    with open_input(path) as file:
        if head := file.read(_HEAD):
            return head
    raise DataError(EMPTY, where=str(path))
