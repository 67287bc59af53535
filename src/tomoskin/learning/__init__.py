"""What is learnt from examples: positions, forces and depths, classes, bends, mapping."""

from pathlib import Path
from typing import Any

from tomoskin.core import DataError, StrPath, load_arrays
from tomoskin.learning.amount.amount_model import AmountModel
from tomoskin.learning.amount.amount_process import AmountProcess
from tomoskin.learning.amount.amount_report import DEPTH, FORCE, least_known, report_of
from tomoskin.learning.amount.labelled_presses import LabelledPresses
from tomoskin.learning.amount.measurand import MEASURED, Measurand, Weight
from tomoskin.learning.bend.bend_model import BendModel
from tomoskin.learning.bend.bend_reader import BENDS, BendReader, BendReading
from tomoskin.learning.bend.recorded_bends import BendExamples, JointReference
from tomoskin.learning.classes.classifier import CLASSES, Answers, Classifier, ClassReading
from tomoskin.learning.classes.examples import Codes, Examples, against_rest
from tomoskin.learning.kind import (
    Calibration,
    Differences,
    FrameView,
    Kind,
    Progress,
    TouchFit,
    silent,
)
from tomoskin.learning.mapping.mapping import ChannelMapping, ring_of
from tomoskin.learning.mapping.solve import MappingAnswer, solve_channel_mapping
from tomoskin.learning.touch.calibration_health import (
    CalibrationHealth,
    LeftOut,
    growth_of_errors,
    worse,
)
from tomoskin.learning.touch.located_touch import TOUCH
from tomoskin.learning.touch.locator import Locator, detection_at
from tomoskin.learning.touch.presses import Presses
from tomoskin.learning.touch.rubbing import Rubbing, quiet_electrodes
from tomoskin.learning.touch.session_alignment import SessionAlignment
from tomoskin.learning.touch.several import Several
from tomoskin.learning.touch.watch import Watch

KINDS: tuple[Kind[Any], ...] = (TOUCH, FORCE, DEPTH, BENDS, CLASSES)
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


__all__ = [
    "BENDS",
    "CLASSES",
    "DEPTH",
    "FORCE",
    "KINDS",
    "MEASURED",
    "TOUCH",
    "AmountModel",
    "AmountProcess",
    "Answers",
    "BendExamples",
    "BendModel",
    "BendReader",
    "BendReading",
    "Calibration",
    "CalibrationHealth",
    "ChannelMapping",
    "ClassReading",
    "Classifier",
    "Codes",
    "Differences",
    "Examples",
    "FrameView",
    "JointReference",
    "Kind",
    "LabelledPresses",
    "LeftOut",
    "Locator",
    "MappingAnswer",
    "Measurand",
    "Presses",
    "Rubbing",
    "SessionAlignment",
    "Several",
    "TouchFit",
    "Watch",
    "Weight",
    "against_rest",
    "detection_at",
    "growth_of_errors",
    "least_known",
    "load_calibration",
    "quiet_electrodes",
    "report_of",
    "ring_of",
    "solve_channel_mapping",
    "worse",
]
