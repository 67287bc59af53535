"""A calibration of touch as a file: the labelled presses, and what they were made on.

Keys of the .npz: ``kind``, ``version``; ``dv`` (n, n_meas), ``xy_m`` (n, 2), optional ``strength``
(n,); ``outline_m`` (k, 2); ``drive``, ``measure`` (n_meas, 2), ``n_electrodes``; ``pattern``,
``skin`` identities, ``skin_name``. What was learnt is learnt again when the file is read, which
gives the same locator: a file outlives the method.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from tomoskin.calibration.calibration_file import CalibrationFile, located
from tomoskin.calibration.locator.locator import Locator
from tomoskin.calibration.locator.presses import Presses
from tomoskin.core import (
    Arrays,
    DataError,
    load_arrays,
    pack_arrays,
    real_numbers,
    save_arrays,
    unpack_arrays,
)
from tomoskin.pattern import Pattern
from tomoskin.touch import Region

CALIBRATION_FILE = "calibration.npz"
"""Name of the calibration inside a session."""

_FILE = CalibrationFile(
    "tomoskin touch calibration", 1, "touch", "touch", frozenset({"dv", "xy_m", "outline_m"})
)


@dataclass(frozen=True, eq=False)
class Calibration:
    """A locator with the pattern of its rows and the name of its skin ("" where there is none)."""

    locator: Locator
    pattern: Pattern
    skin_name: str = ""


def write_calibration(path: Path, calibration: Calibration, *, overwrite: bool = False) -> None:
    """Write the file; raises as :func:`written` does."""
    save_arrays(path, _arrays(calibration), overwrite=overwrite)


def pack_calibration(calibration: Calibration) -> bytes:
    """The same file's bytes, for a session that holds it."""
    return pack_arrays(_arrays(calibration))


def _arrays(calibration: Calibration) -> Arrays:
    locator, pattern = calibration.locator, calibration.pattern
    arrays: Arrays = _FILE.header(pattern, calibration.skin_name) | {
        "dv": locator.presses.dv,
        "xy_m": locator.presses.xy,
        "outline_m": locator.region.outline,
        "pattern": np.array(locator.pattern_id),
        "skin": np.array(locator.skin_id),
    }
    if locator.presses.strength is not None:
        arrays["strength"] = locator.presses.strength
    return arrays


def read_calibration(
    path: Path, progress: Callable[[float, float], None] = lambda _done, _total: None
) -> Calibration:
    """Read the file and learn from its presses again.

    Raises
    ------
    DataError
        When it is missing, damaged, or no calibration of touch.
    """
    return _read(load_arrays(path), str(path), progress)


def unpack_calibration(data: bytes, where: str) -> Calibration:
    """:func:`read_calibration` from the file's bytes."""
    return _read(unpack_arrays(data, where), where, lambda _done, _total: None)


def _read(arrays: Arrays, where: str, progress: Callable[[float, float], None]) -> Calibration:
    pattern = _FILE.pattern(arrays, where)
    strength = real_numbers(arrays, "strength", where) if "strength" in arrays else None
    dv = real_numbers(arrays, "dv", where)
    if dv.shape[1:] != (pattern.n_meas,):
        raise DataError(f"expected {pattern.n_meas} rows of dv", where=where)
    with located(where):
        presses = Presses.of(dv, real_numbers(arrays, "xy_m", where), strength)
        region = Region.checked(real_numbers(arrays, "outline_m", where))
        skin_id = str(arrays.get("skin", ""))
        locator = Locator.learn(presses.within(region), region, pattern, skin_id, progress)
    return Calibration(locator, pattern, str(arrays.get("skin_name", "")))
