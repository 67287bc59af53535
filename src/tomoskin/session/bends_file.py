"""A calibration of bends as a file: the recorded bends, and what they were made on.

Keys of the .npz: ``kind``, ``version``; ``dv`` (n, n_meas) V, ``angle_rad``, ``axis_rad``,
``time_s`` (n,); ``covariance`` (n_meas, n_meas) V²; ``drive``, ``measure`` (n_meas, 2),
``n_electrodes``; ``skin_name``. What was learnt is learnt again when it is read.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from tomoskin.core import DataError, ModelError, PatternError
from tomoskin.pattern import Pattern
from tomoskin.session.archive import load_arrays, save_arrays
from tomoskin.session.interchange import electrode_table, real_numbers, whole_number
from tomoskin.touch import BendExamples, BendModel

_KIND, _VERSION = "tomoskin bend calibration", 1
_NEEDED = frozenset(
    {"version", "dv", "angle_rad", "axis_rad", "time_s", "covariance"}
    | {"drive", "measure", "n_electrodes"}
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


def write_bends(path: Path, calibration: BendCalibration) -> None:
    """Write the file whole or not at all. Raises DataError when it cannot be written."""
    model, pattern = calibration.model, calibration.pattern
    save_arrays(
        path,
        {
            "kind": np.array(_KIND),
            "version": np.array(_VERSION),
            "dv": model.examples.dv,
            "angle_rad": model.examples.angle,
            "axis_rad": model.examples.axis,
            "time_s": model.examples.time,
            "covariance": model.covariance,
            "drive": pattern.drive,
            "measure": pattern.measure,
            "n_electrodes": np.array(pattern.n_electrodes),
            "skin_name": np.array(calibration.skin_name),
        },
    )


def read_bends(path: Path) -> BendCalibration:
    """Read the file and learn from its bends again.

    Raises
    ------
    DataError
        When it is missing, damaged, or no calibration of bends.
    """
    arrays, where = load_arrays(path), str(path)
    if str(arrays.get("kind", "")) != _KIND or not set(arrays) >= _NEEDED:
        raise DataError(
            "is not a calibration of bends", where=where, hint="make one: tomoskin calibrate bend"
        )
    if whole_number(arrays, "version", where) != _VERSION:
        raise DataError(f"expected version {_VERSION}, got {arrays['version']}", where=where)
    drive, measure = (electrode_table(arrays, key, where) for key in ("drive", "measure"))
    try:
        pattern = Pattern.from_tables(drive, measure, whole_number(arrays, "n_electrodes", where))
        dv, *labels, covariance = (
            real_numbers(arrays, key, where)
            for key in ("dv", "angle_rad", "axis_rad", "time_s", "covariance")
        )
        if covariance.shape != (pattern.n_meas,) * 2 or dv.shape[1:] != (pattern.n_meas,):
            raise DataError(f"expected {pattern.n_meas} rows of dv and covariance")
        model = BendModel.learn(BendExamples.of(dv, *labels), covariance)
    except (DataError, ModelError, PatternError) as error:
        raise DataError(error.message, where=f"{where}, {error.where}".rstrip(", ")) from error
    return BendCalibration(model, pattern, str(arrays.get("skin_name", "")))
