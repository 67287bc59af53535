"""A calibration of bends as a file: the recorded bends, and what they were made on.

Keys of the .npz: ``kind``, ``version``; ``dv`` (n, n_meas) V, ``angle_rad``, ``axis_rad``,
``time_s`` (n,); ``covariance`` (n_meas, n_meas) V²; ``drive``, ``measure`` (n_meas, 2),
``n_electrodes``; ``skin_name``. What was learnt is learnt again when it is read.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from tomoskin.calibration.bending.examples import BendExamples
from tomoskin.calibration.bending.model import BendModel
from tomoskin.calibration.calibration_file import CalibrationFile, located
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

BENDS_FILE = "bends.npz"
"""Name of the calibration inside a session."""

_FILE = CalibrationFile(
    "tomoskin bend calibration",
    1,
    "bends",
    "bend",
    frozenset({"dv", "angle_rad", "axis_rad", "time_s", "covariance"}),
)


@dataclass(frozen=True, eq=False)
class BendCalibration:
    """What bends do, with the pattern of its rows and the name of its skin."""

    model: BendModel
    pattern: Pattern
    skin_name: str = ""

    def check(self, pattern: Pattern) -> None:
        """Raise DataError for rows of another scan."""
        if pattern.identity != self.pattern.identity:
            raise DataError(
                f'the calibration of bends is of another scan, that of "{self.skin_name}"',
                hint="learn the bends of this one: tomoskin calibrate bend",
            )


def write_bends(path: Path, calibration: BendCalibration, *, overwrite: bool = False) -> None:
    """Write the file; raises as :func:`written` does."""
    save_arrays(path, _arrays(calibration), overwrite=overwrite)


def pack_bends(calibration: BendCalibration) -> bytes:
    """The same file's bytes, for a session that holds it."""
    return pack_arrays(_arrays(calibration))


def _arrays(calibration: BendCalibration) -> Arrays:
    model, pattern = calibration.model, calibration.pattern
    return _FILE.header(pattern, calibration.skin_name) | {
        "dv": model.examples.dv,
        "angle_rad": model.examples.angle,
        "axis_rad": model.examples.axis,
        "time_s": model.examples.time,
        "covariance": model.covariance,
    }


def read_bends(path: Path) -> BendCalibration:
    """Read the file and learn from its bends again.

    Raises
    ------
    DataError
        When it is missing, damaged, or no calibration of bends.
    """
    return _read(load_arrays(path), str(path))


def unpack_bends(data: bytes, where: str) -> BendCalibration:
    """:func:`read_bends` from the file's bytes."""
    return _read(unpack_arrays(data, where), where)


def _read(arrays: Arrays, where: str) -> BendCalibration:
    pattern = _FILE.pattern(arrays, where)
    with located(where):
        dv, *labels, covariance = (
            real_numbers(arrays, key, where)
            for key in ("dv", "angle_rad", "axis_rad", "time_s", "covariance")
        )
        if covariance.shape != (pattern.n_meas,) * 2 or dv.shape[1:] != (pattern.n_meas,):
            raise DataError(f"expected {pattern.n_meas} rows of dv and covariance")
        model = BendModel.learn(BendExamples.of(dv, *labels), covariance)
    return BendCalibration(model, pattern, str(arrays.get("skin_name", "")))
