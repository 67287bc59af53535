"""A set of labelled frames on disk: shards that are there whole or not at all, or one file."""

from __future__ import annotations

import zipfile
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tomoskin.core import Arrays, DataError, OutputError, StrPath, load_arrays, save_arrays

IDENTITY = "identity"
"""Array that says of which set and shard a file is."""

_DAMAGED = "damaged"
"""What a shard says of itself that cannot be read to its end."""

_FIXED = ("drive", "measure", "reference")
"""Arrays that are the same in every shard."""


def shard_path(folder: StrPath, shard: int) -> Path:
    """The file of one shard in the folder of a set."""
    return Path(folder) / f"part-{shard:05d}.npz"


def write_whole(
    path: StrPath, arrays: Mapping[str, NDArray[Any]], *, overwrite: bool = False
) -> None:
    """:func:`save_arrays` into a folder that is made where it is not there."""
    try:
        Path(path).parent.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise DataError(f"cannot be written: {error.strerror}", where=str(path)) from error
    save_arrays(path, arrays, overwrite=overwrite)


def is_done(path: StrPath, identity: str, *, overwrite: bool = False) -> bool:
    """Whether the shard is there, whole, and the one of this ``identity``.

    A damaged shard, or one of the set with fewer frames, is to be made again. Raises OutputError
    for any other file, unless ``overwrite``.
    """
    if not Path(path).exists():
        return False
    present = _identity_in(Path(path))
    if present.split()[:1] == identity.split()[:1]:
        return present == identity
    if present != _DAMAGED and not overwrite:
        raise OutputError(
            f"belongs to another set: expected {identity}, got {present or 'no part of a set'}",
            where=str(path),
            hint="choose another folder, or remove the files in it",
        )
    return False


def _identity_in(path: Path) -> str:
    """What a file says of itself; "" where it says nothing."""
    try:
        with zipfile.ZipFile(path) as archive:
            if archive.testzip() is not None:
                return _DAMAGED
        return str(load_arrays(path)[IDENTITY])
    except KeyError:
        return ""
    except (DataError, OSError, zipfile.BadZipFile):
        return _DAMAGED if f"{IDENTITY}.npy".encode() in path.read_bytes() else ""


def join_shards(paths: Iterable[StrPath], path: StrPath, *, overwrite: bool = False) -> None:
    """One file of all shards, in their order.

    Raises
    ------
    DataError
        When a shard cannot be read or the file cannot be written.
    """
    shards = [load_arrays(part) for part in paths]
    joined: Arrays = {
        key: shards[0][key] if key in _FIXED else np.concatenate([shard[key] for shard in shards])
        for key in shards[0]
        if key != IDENTITY
    }
    write_whole(path, joined, overwrite=overwrite)
