"""The kinds of calibrations that are applied to frames, and a file of any of them."""

from pathlib import Path
from typing import Any

from tomoskin.core import DataError, StrPath, load_arrays
from tomoskin.learning.amount.amount_report import DEPTH, FORCE
from tomoskin.learning.body.body_reader import BODY
from tomoskin.learning.classes.classifier import CLASSES
from tomoskin.learning.kind import Calibration, Kind, Progress, silent
from tomoskin.learning.touch.located_touch import TOUCH

KINDS: tuple[Kind[Any], ...] = (TOUCH, FORCE, DEPTH, BODY, CLASSES)
"""Every kind whose calibrations are applied to frames, in the order in which they are applied."""


def load_calibration(path: StrPath, progress: Progress = silent) -> Calibration[Any]:
    """Read a file of any of the :data:`KINDS`. Raises DataError where it is of none."""
    arrays = load_arrays(Path(path))
    title = str(arrays.get("kind", ""))
    kind = next((kind for kind in KINDS if kind.title == title), None)
    if kind is None:
        raise DataError(
            "is not a calibration", where=str(path), hint="make one: tomoskin calibrate --help"
        )
    return kind.unpack(arrays, str(path), progress)
