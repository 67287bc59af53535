"""A set of labelled frames on disk: shards that are there whole or not at all, or one file."""

from __future__ import annotations

import os
import zipfile
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tomoskin.core import DataError
from tomoskin.session.archive import Arrays, load_arrays

IDENTITY = "identity"
"""Array that says of which set and shard a file is."""

_FIXED = ("drive", "measure", "reference")
"""Arrays that are the same in every shard."""


def shard_path(folder: Path, shard: int) -> Path:
    """File of a shard."""
    return folder / f"part-{shard:05d}.npz"


def write_whole(path: Path, arrays: Mapping[str, NDArray[Any]]) -> None:
    """Write ``arrays`` as a .npz file that appears when it is complete; the same bytes each time.

    Raises
    ------
    DataError
        When it cannot be written.
    """
    partial = path.with_name(f".{path.name}.partial")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with partial.open("wb") as file:
            np.savez_compressed(file, allow_pickle=False, **arrays)
            file.flush()
            os.fsync(file.fileno())
        partial.replace(path)
    except OSError as error:
        raise DataError(f"cannot be written: {error.strerror}", where=str(path)) from error


def is_done(path: Path, identity: str) -> bool:
    """Whether the shard is there, whole, and the one of this ``identity``.

    A torn file, or one with fewer frames, is not there. Raises DataError for one of another set.
    """
    if not path.exists():
        return False
    try:
        with zipfile.ZipFile(path) as archive:
            if archive.testzip() is not None:
                return False
        found = str(load_arrays(path)[IDENTITY])
    except (DataError, KeyError, OSError, zipfile.BadZipFile):
        return False
    if found.split()[:1] != identity.split()[:1]:
        raise DataError(
            f"is of another set: expected {identity}, got {found}",
            where=str(path),
            hint="choose another --out, or remove what is there",
        )
    return found == identity


def join_shards(paths: Iterable[Path], path: Path) -> None:
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
    write_whole(path, joined)
