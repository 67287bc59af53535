"""The kinds of calibrations that are applied to frames, and a file of any of them."""

from functools import cache
from pathlib import Path
from typing import Any

from tomoskin.core import DataError, StrPath, load_arrays, registered
from tomoskin.learning.amount.amount_model import DEPTH, FORCE
from tomoskin.learning.kind import Calibration, Kind, Progress, silent
from tomoskin.learning.touch.located_touch import TOUCH


@cache
def calibration_kinds() -> tuple[Kind[Any], ...]:
    """Every kind whose calibrations are applied to frames, in the order in which they are applied.

    Those of the core come first, then those that are registered, in the order of
    :func:`tomoskin.core.registered`.
    """
    more = (one.load() for one in registered("calibrations").values())
    return (TOUCH, FORCE, DEPTH, *more)


def load_calibration(path: StrPath, progress: Progress = silent) -> Calibration[Any]:
    """Read a file of any of the :func:`calibration_kinds`. Raises DataError where it is of none."""
    arrays = load_arrays(Path(path))
    title = str(arrays.get("kind", ""))
    kind = next((kind for kind in calibration_kinds() if kind.title == title), None)
    if kind is None:
        raise DataError(
            "is not a calibration", where=str(path), hint="make one: tomoskin calibrate --help"
        )
    return kind.unpack(arrays, str(path), progress)
