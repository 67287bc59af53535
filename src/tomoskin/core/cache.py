"""Arrays that take long to compute are kept on disk, and made again wherever that fails."""

from __future__ import annotations

import os
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from platformdirs import user_cache_path

from tomoskin.core.archive import Arrays, load_arrays
from tomoskin.core.errors import DataError
from tomoskin.core.outputs import written

VARIABLE = "TOMOSKIN_CACHE"
"""Environment variable that names the folder; "off": nothing is kept."""

MOST_BYTES = 1 << 29
"""Beyond it the files that were not used for longest go."""


def kept(name: str, make: Callable[[], Arrays]) -> Arrays:
    """What ``make`` returns: from the file ``name``, which holds it since it was first made.

    ``name`` says all that the result depends on, as a hash does. A disk that cannot be read or
    written costs time, and nothing else. Arrays lie in memory as those of the file do: sums over
    other strides round otherwise, and a replay of the first run would differ in the last bits.
    """
    folder = cache_folder()
    if folder is None:
        return _dense(make())
    path = folder / f"{name}.npz"
    with suppress(DataError, OSError):
        arrays = dict(load_arrays(path))
        path.touch()  # used last
        return arrays
    arrays = _dense(make())
    with suppress(DataError, OSError):
        folder.mkdir(parents=True, exist_ok=True)
        with written(path, overwrite=True) as part, part.open("wb") as file:
            np.savez(file, allow_pickle=False, **arrays)
        _discard_oldest(folder)
    return arrays


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
