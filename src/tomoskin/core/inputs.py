"""Opening the files of a user for reading, and how much of this machine's memory one may take."""

from __future__ import annotations

import os
from contextlib import suppress
from importlib import import_module
from pathlib import Path
from typing import BinaryIO

from tomoskin.core.errors import DataError, TomoskinError
from tomoskin.core.outputs import StrPath


def check_is_file(path: StrPath, error: type[TomoskinError] = DataError) -> None:
    """Raise ``error`` where ``path`` is no ordinary file: a pipe or a device may never end."""
    path = Path(path)
    try:
        if not path.exists():
            raise error("there is no such file", where=str(path))
        if path.is_dir():
            raise error("is a folder, not a file", where=str(path))
        if not path.is_file():
            raise error(
                "is a pipe or a device, not a file",
                where=str(path),
                hint="copy what comes out of it into a file",
            )
    except (OSError, ValueError) as cause:  # a name that is too long, or has a zero byte
        reason = getattr(cause, "strerror", None) or str(cause)
        raise error(f"cannot be read: {reason}", where=str(path)[:80]) from cause


def open_input(
    path: StrPath, buffering: int = -1, error: type[TomoskinError] = DataError
) -> BinaryIO:
    """An ordinary file, open for reading bytes.

    Raises
    ------
    TomoskinError
        Of the kind ``error``, when it is missing, a folder, a pipe or a device, or unreadable.
    """
    check_is_file(path, error)
    try:
        return Path(path).open("rb", buffering=buffering)
    except OSError as cause:
        raise error(f"cannot be read: {cause.strerror or cause}", where=str(path)) from cause


_SHARE = 4
"""A file may take one part in so many: what is made of it takes two or three times as much."""

_UNKNOWN = 4 << 30
"""Bytes of memory where the system does not say."""

_OF_CONTAINER = ("/sys/fs/cgroup/memory.max", "/sys/fs/cgroup/memory/memory.limit_in_bytes")


def machine_memory() -> int:
    """Bytes of memory that this process can have: the machine's, its container's or its limit."""
    found = []
    with suppress(AttributeError, ValueError, OSError):
        found.append(os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES"))
    for path in _OF_CONTAINER:
        with suppress(OSError, ValueError):  # "max" where there is no limit
            found.append(int(Path(path).read_text()))
    with suppress(ImportError):  # on Windows
        limits = import_module("resource")
        found.append(limits.getrlimit(limits.RLIMIT_AS)[0])
    return min((size for size in found if size > 0), default=_UNKNOWN)


def most_bytes() -> int:
    """Bytes that one file may take in memory."""
    return machine_memory() // _SHARE


def check_fits(size: int, where: str) -> None:
    """Raise DataError where ``size`` bytes are more than a file may take."""
    if size > most_bytes():
        raise DataError(
            f"takes {size / 2**30:.1f} GiB, more than a quarter of this machine's "
            f"{machine_memory() / 2**30:.1f} GiB of memory",
            where=where,
            hint="take a part of it, or a larger machine",
        )
