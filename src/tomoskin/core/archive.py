"""Arrays in .npz archives: writing them, opening those that may be damaged or hostile, checking
them, and keeping on disk those that take long to compute."""

from __future__ import annotations

import io
import math
import os
import time
import tokenize
import zipfile
import zlib
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any, TextIO

import numpy as np
from numpy.typing import NDArray
from platformdirs import user_cache_path

from tomoskin.core.errors import EMPTY, DataError, TomoskinError
from tomoskin.core.records import FloatArray, IntArray
from tomoskin.core.stages import reach
from tomoskin.core.user_files import StrPath, check_fits, open_input, written

try:
    import fcntl
except ImportError:  # Windows
    fcntl = None  # type: ignore[assignment]

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

_IN_MEMORY = dict.fromkeys("biuf", 8) | {"c": 16}
"""Bytes that a number of each kind becomes, however small it is in the file."""

Arrays = Mapping[str, NDArray[Any]]
"""Arrays by their name."""


class Archive(Arrays):
    """The arrays of a .npz file, each read when it is asked for; never unpickles.

    Parameters
    ----------
    file
        Its path or its bytes.
    where
        What it is called in messages.

    Raises
    ------
    DataError
        When the file is missing, no archive, or would be too large in memory; when an array that
        is asked for is torn or holds objects.
    """

    def __init__(self, file: Path | bytes, where: str) -> None:
        self._file, self._where = file, where
        with self._opened() as archive:
            self._names = {name.removesuffix(".npy"): name for name in archive.namelist()}
            check_fits(sum(_size(archive, name) for name in self._names.values()), where)

    def __getitem__(self, key: str) -> NDArray[Any]:
        """Read the array of this name from the file."""
        name = self._names[key]
        with self._opened() as archive, archive.open(name) as member:
            if not name.endswith(".npy"):
                return np.asarray(member.read())
            array: NDArray[Any] = np.lib.format.read_array(member, allow_pickle=False)
            return array

    def __iter__(self) -> Iterator[str]:
        """Yield the names of the arrays."""
        return iter(self._names)

    def __len__(self) -> int:
        """The number of arrays in the file."""
        return len(self._names)

    @contextmanager
    def _opened(self) -> Iterator[zipfile.ZipFile]:
        """The archive; whatever it does not say as it should is a DataError."""
        where = self._where
        file = self._file
        try:
            with (
                io.BytesIO(file) if isinstance(file, bytes) else open_input(file) as opened,
                zipfile.ZipFile(opened) as archive,
            ):
                yield archive
        except OSError as error:
            raise DataError(f"cannot be read: {error.strerror or error}", where=where) from error
        except (zipfile.BadZipFile, EOFError, zipfile.LargeZipFile) as error:
            if not (len(file) if isinstance(file, bytes) else file.stat().st_size):
                raise DataError(EMPTY, where=where) from error
            raise DataError(
                f"is not a whole .npz archive: {error}",
                where=where,
                hint="name a .npz file; if it is one, copy it again",
            ) from error
        except _UNREADABLE as error:
            raise DataError(f"holds an array that cannot be read: {error}", where=where) from error


def load_arrays(path: StrPath) -> Arrays:
    """The arrays of a .npz file; raises as :class:`Archive` does."""
    return Archive(Path(path), str(path))


def unpack_arrays(data: bytes, where: str) -> Arrays:
    """The arrays of the bytes of a .npz file; raises as :class:`Archive` does."""
    return Archive(data, where)


def pack_arrays(arrays: Arrays) -> bytes:
    """Bytes of an .npz file with these arrays."""
    file = io.BytesIO()
    np.savez_compressed(file, allow_pickle=False, **arrays)
    return file.getvalue()


def save_arrays(path: StrPath, arrays: Arrays, *, overwrite: bool = False) -> None:
    """Write a .npz file, the same bytes each time; raises as :func:`written` does."""
    with written(path, overwrite=overwrite) as part, part.open("wb") as file:
        np.savez_compressed(file, allow_pickle=False, **arrays)


def _size(archive: zipfile.ZipFile, name: str) -> int:
    """Bytes of a member in memory, by what it says of itself; ValueError where it holds less."""
    held = archive.getinfo(name).file_size
    if not name.endswith(".npy"):
        return held
    with archive.open(name) as member:
        first = np.lib.format.read_magic(member) == (1, 0)
        read = np.lib.format.read_array_header_1_0 if first else np.lib.format.read_array_header_2_0
        shape, _, dtype = read(member)
        begun = member.tell()
    count = math.prod(shape)
    if dtype.hasobject:
        return held
    if count < 0 or count * dtype.itemsize > held - begun:
        raise ValueError(f"{name} has the shape {shape} in its header but holds {held} bytes")
    return int(count * max(dtype.itemsize, _IN_MEMORY.get(dtype.kind, 0)))


MOST_ELECTRODES = 1024
"""More are taken for damage of a file."""


def numeric(
    value: Any, error: type[TomoskinError], what: str = "", where: str = "", *, real: bool = False
) -> NDArray[Any]:
    """``value`` as an array of numbers, or an ``error`` that says ``what`` they should be."""
    numbers = "real numbers" if real else "numbers"
    try:
        array = np.asarray(value)
    except ValueError as cause:
        raise error("expected rows of equal length, got different lengths", where=where) from cause
    if array.dtype.kind not in ("biuf" if real else "biufc"):
        raise error(f"expected {numbers}{what}, got {array.dtype}", where=where)
    return array


def refuse_first(
    bad: NDArray[np.bool_] | np.bool_,
    values: NDArray[Any],
    expected: str,
    place: str,
    error: type[TomoskinError],
) -> None:
    """Raise an ``error`` for the first of ``values`` that is ``bad``, (n,), at that ``place``."""
    if bad.any():
        first = int(np.argmax(bad))
        raise error(f"expected {expected}, got {values[first].tolist()}", where=f"{place} {first}")


def numbers(arrays: Arrays, key: str, source: str) -> NDArray[Any]:
    """Array ``key`` as float64, or complex128 where it is complex."""
    array = numeric(arrays[key], DataError, f" in {key}", source)
    return array.astype(np.complex128 if array.dtype.kind == "c" else np.float64, copy=False)


def real_numbers(arrays: Arrays, key: str, source: str) -> FloatArray:
    """Array ``key`` as float64 numbers."""
    array = numbers(arrays, key, source)
    if array.dtype.kind == "c":
        raise DataError(f"expected real numbers in {key}, got complex ones", where=source)
    return array


def whole_number(arrays: Arrays, key: str, where: str, most: int = 1 << 31) -> int:
    """Array ``key`` as one whole number, at most ``most``."""
    value = real_numbers(arrays, key, where)
    if value.shape or value != np.round(value) or not abs(value) <= most:
        got = f"shape {value.shape}" if value.shape else f"{value:g}"
        raise DataError(f"expected one whole number up to {most} as {key}, got {got}", where=where)
    return int(value)


def electrode_table(arrays: Arrays, key: str, source: str) -> IntArray:
    """Array ``key`` as an (n, 2) table of electrodes from 0."""
    table = real_numbers(arrays, key, source)
    if table.ndim != 2 or table.shape[1] != 2:
        raise DataError(f"expected {key} of shape (n_meas, 2), got {table.shape}", where=source)
    good = (table >= 0) & (table < MOST_ELECTRODES) & (table == np.round(table))
    whole = "whole electrode numbers from 0 (E1)"
    refuse_first(~good.all(axis=1), table, whole, f"{source}, {key} row", DataError)
    return table.astype(np.int64)


VARIABLE = "TOMOSKIN_CACHE"
"""Environment variable that names the folder; "off": nothing is kept."""

MOST_BYTES = 1 << 29
"""Beyond it the files that were not used for longest go."""


_WAIT, _POLL = 600.0, 0.1
"""Seconds at most until another program has made what is wanted here too, and between two looks."""


def kept(name: str, make: Callable[[], Arrays]) -> Arrays:
    """What ``make`` returns: from the file ``name``, which holds it since it was first made.

    ``name`` says all that the result depends on, as a hash does. A disk that cannot be read or
    written costs time, and nothing else. While another program or thread makes the same, this one
    waits for its file. Arrays lie in memory as those of the file do: sums over other strides round
    otherwise, and a replay of the first run would differ in the last bits.
    """
    folder = cache_folder()
    if folder is None:
        return _dense(make())
    path = folder / f"{name}.npz"
    arrays = _read(path)
    if arrays is not None:
        return arrays
    with _alone(path):
        arrays = _read(path)  # another may have made it meanwhile
        if arrays is not None:
            return arrays
        arrays = _dense(make())
        with suppress(DataError, OSError):
            with written(path, overwrite=True) as part, part.open("wb") as file:
                np.savez(file, allow_pickle=False, **arrays)
            _discard_oldest(folder)
    return arrays


def _read(path: Path) -> dict[str, NDArray[Any]] | None:
    """The arrays of a file; None where it is not there or torn."""
    with suppress(DataError, OSError):
        arrays = dict(load_arrays(path))
        path.touch()  # used last
        return arrays
    return None


@contextmanager
def _alone(path: Path) -> Iterator[None]:
    """While the block lasts, no other program is in one for that ``path``, where the disk can say
    so; a lock is the system's, and goes with the program that holds it."""
    lock = path.with_suffix(".lock")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        descriptor = os.open(lock, os.O_CREAT | os.O_RDWR)  # it holds nothing
    except OSError:
        yield
        return
    with os.fdopen(descriptor) as file:
        until = time.monotonic() + _WAIT
        while not _locked(file) and time.monotonic() < until:
            reach()  # who waits may be stopped
            time.sleep(_POLL)
        try:
            yield
        finally:
            with suppress(OSError):
                lock.unlink()


def _locked(file: TextIO) -> bool:
    """Whether the file is locked by us, or cannot be locked at all."""
    if fcntl is None:
        return True
    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    except OSError:  # not on this disk
        return True
    return True


def _dense(arrays: Arrays) -> dict[str, NDArray[Any]]:
    return {name: np.asarray(array, order="C") for name, array in arrays.items()}


def cache_folder() -> Path | None:
    """Where arrays are kept; None where they are not."""
    chosen = os.environ.get(VARIABLE, "")
    if chosen == "off":
        return None
    return Path(chosen) if chosen else user_cache_path("tomoskin", appauthor=False)


def _discard_oldest(folder: Path) -> None:
    files = [(path, path.stat()) for path in folder.glob("*.npz")]
    files.sort(key=lambda item: item[1].st_mtime, reverse=True)
    total = 0
    for path, state in files:
        total += state.st_size
        if total > MOST_BYTES:
            path.unlink(missing_ok=True)
