"""MATLAB files (v5 to v7) as plain arrays and structures, refused where they would not end."""

from __future__ import annotations

import math
import struct
import zlib
from pathlib import Path
from typing import Any

from scipy.io import loadmat, whosmat

from tomoskin.core import DataError, check_fits

_HEAD = 128
_COMPRESSED = 15
_BLOCK = 1 << 20
_NUMBER = 8
_HOLDERS = ("struct", "cell", "object", "opaque", "function", "sparse")
"""What holds variables of its own: it is measured by what it unpacks to."""


def is_matlab(beginning: bytes) -> bool:
    """Whether a file begins as MATLAB's do."""
    return beginning.startswith(b"MATLAB ")


def load_matlab(path: Path) -> dict[str, Any]:
    """Variables by name; structures are dicts, arrays of them lists of dicts.

    Raises
    ------
    DataError
        When the file is of v7.3, damaged, or would be too large in memory.
    """
    where = str(path)
    try:
        _check_size(path)
        variables = loadmat(path, simplify_cells=True)
    except NotImplementedError as error:
        raise DataError(
            "is a MATLAB file of version 7.3", where=where, hint="save it with -v7"
        ) from error
    except DataError:
        raise
    except MemoryError as error:
        raise DataError("is too large for the memory of this machine", where=where) from error
    except Exception as error:
        # scipy raises whatever its parser meets in a damaged file
        raise DataError(f"is damaged, or not a MATLAB file: {error}", where=where) from error
    return {key: value for key, value in variables.items() if not key.startswith("__")}


def _check_size(path: Path) -> None:
    """Unpack every compressed variable a block at a time, keeping none of it.

    What a number takes in memory is more than in the file, where small ones stand as bytes.
    """
    shapes = [shape for _, shape, kind in whosmat(path) if kind not in _HOLDERS]
    check_fits(sum(_NUMBER * math.prod(shape) for shape in shapes), str(path))
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
            check_fits(total, str(path))


def _unpacked(data: bytes, total: int, where: str) -> int:
    unpack = zlib.decompressobj()
    while data:
        total += len(unpack.decompress(data, _BLOCK))
        check_fits(total, where)
        data = unpack.unconsumed_tail
    return total
