"""MATLAB files (v5 to v7) as plain arrays and structures, refused where they would not end."""

from __future__ import annotations

import struct
import zlib
from pathlib import Path
from typing import Any

from scipy.io import loadmat

from tomoskin.core import DataError

MAX_BYTES = 2 << 30
"""A file that unpacks to more than this is refused."""

_HEAD = 128
_COMPRESSED = 15
_BLOCK = 1 << 20


def is_matlab(beginning: bytes) -> bool:
    """Whether a file begins as MATLAB's do."""
    return beginning.startswith(b"MATLAB ")


def load_matlab(path: Path) -> dict[str, Any]:
    """Variables by name; structures are dicts, arrays of them lists of dicts.

    Raises
    ------
    DataError
        When the file is of v7.3, damaged, or would unpack to more than ``MAX_BYTES``.
    """
    where = str(path)
    try:
        _check_size(path)
        found = loadmat(path, simplify_cells=True)
    except NotImplementedError as error:
        raise DataError(
            "is a MATLAB file of version 7.3", where=where, hint="save it with -v7"
        ) from error
    except DataError:
        raise
    except MemoryError as error:
        raise DataError("does not fit into memory", where=where) from error
    except Exception as error:
        # scipy raises whatever its parser meets in a damaged file
        raise DataError(f"is damaged or no MATLAB file: {error}", where=where) from error
    return {key: value for key, value in found.items() if not key.startswith("__")}


def _check_size(path: Path) -> None:
    """Unpack every compressed variable a block at a time, keeping none of it."""
    total = 0
    with path.open("rb") as file:
        file.seek(_HEAD - 2)
        order = "<" if file.read(2) == b"IM" else ">"
        while len(head := file.read(8)) == 8:
            kind, size = struct.unpack(f"{order}II", head)
            if kind != _COMPRESSED:
                total += size
                file.seek(size, 1)
            else:
                total = _unpacked(file.read(size), total, str(path))
            _check_total(total, str(path))


def _unpacked(data: bytes, total: int, where: str) -> int:
    unpack = zlib.decompressobj()
    while data:
        total += len(unpack.decompress(data, _BLOCK))
        _check_total(total, where)
        data = unpack.unconsumed_tail
    return total


def _check_total(total: int, where: str) -> None:
    if total > MAX_BYTES:
        raise DataError(
            f"unpacks to more than {MAX_BYTES / 2**30:.0f} GiB", where=where, hint="split it"
        )
