"""Writing .npz archives, and opening those that may be damaged, hostile or of another kind."""

from __future__ import annotations

import io
import tokenize
import zipfile
import zlib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tomoskin.core.errors import EMPTY, DataError
from tomoskin.core.written import written

MAX_BYTES = 4 << 30
"""An archive that unpacks to more than this is refused."""

_UNREADABLE = (
    ValueError,
    KeyError,
    OverflowError,
    MemoryError,  # a header may claim any size
    RuntimeError,  # encrypted, or compressed in an unknown way
    SyntaxError,
    tokenize.TokenError,
    zlib.error,
)
"""What numpy and zipfile raise for an array that is torn, foreign or hostile."""

Arrays = dict[str, NDArray[Any]]


def load_arrays(path: Path) -> Arrays:
    """All arrays of a .npz file; never unpickles. Raises as :func:`unpack_arrays` does."""
    return _arrays(path, str(path))


def unpack_arrays(data: bytes, where: str) -> Arrays:
    """All arrays of the bytes of a .npz file; never unpickles.

    Raises
    ------
    DataError
        When the file is missing, no archive, torn, too large when unpacked, or holds objects.
    """
    return _arrays(io.BytesIO(data), where)


def pack_arrays(arrays: Arrays) -> bytes:
    """The bytes of a .npz file."""
    file = io.BytesIO()
    np.savez_compressed(file, allow_pickle=False, **arrays)
    return file.getvalue()


def _arrays(file: Path | io.BytesIO, where: str) -> Arrays:
    try:
        _check_size(file, where)
        if isinstance(file, io.BytesIO):
            file.seek(0)
        with np.load(file, allow_pickle=False) as archive:
            return {key: np.asarray(archive[key]) for key in archive.files}
    except FileNotFoundError as error:
        raise DataError("there is no such file", where=where) from error
    except OSError as error:
        raise DataError(f"cannot be read: {error.strerror or error}", where=where) from error
    except (zipfile.BadZipFile, EOFError, zipfile.LargeZipFile) as error:
        raise DataError(
            f"is not a whole .npz archive: {error}", where=where, hint="copy it again"
        ) from error
    except _UNREADABLE as error:
        raise DataError(f"holds an array that cannot be read: {error}", where=where) from error


def save_arrays(path: Path, arrays: Mapping[str, NDArray[Any]], *, overwrite: bool = False) -> None:
    """Write a .npz file, the same bytes each time; raises as :func:`written` does."""
    with written(path, overwrite=overwrite) as part, part.open("wb") as file:
        np.savez_compressed(file, allow_pickle=False, **arrays)


def _check_size(file: Path | io.BytesIO, where: str) -> None:
    if isinstance(file, Path) and not file.stat().st_size:
        raise DataError(EMPTY, where=where)
    with zipfile.ZipFile(file) as archive:
        size = sum(member.file_size for member in archive.infolist())
    if size > MAX_BYTES:
        raise DataError(
            f"unpacks to {size / 2**30:.1f} GiB, more than {MAX_BYTES / 2**30:.0f}",
            where=where,
            hint="split it",
        )
