"""What is learnt from examples: touch positions, forces, classes, bends, channel mapping."""

from pathlib import Path
from typing import Any

from tomoskin._moved import moved
from tomoskin.calibration.bending.examples import BendExamples
from tomoskin.calibration.bending.joint import JointReference
from tomoskin.calibration.bending.model import BendModel
from tomoskin.calibration.bending.reader import BendReader, BendReading
from tomoskin.calibration.bends import BENDS
from tomoskin.calibration.channel_mapping.mapping import ChannelMapping, ring_of
from tomoskin.calibration.channel_mapping.solve import MappingAnswer, solve_channel_mapping
from tomoskin.calibration.classes import CLASSES, ClassReading, FrameClassifier
from tomoskin.calibration.classifier.alignment import Alignment
from tomoskin.calibration.classifier.classifier import Answers, Classifier
from tomoskin.calibration.classifier.examples import Codes, Examples, against_rest
from tomoskin.calibration.force import FORCE
from tomoskin.calibration.kind import (
    Applied,
    Calibration,
    Conditions,
    Differences,
    FrameView,
    Kind,
    Progress,
    TouchFit,
    silent,
)
from tomoskin.calibration.locator.health import CalibrationHealth
from tomoskin.calibration.locator.left_out import LeftOut
from tomoskin.calibration.locator.locator import Locator
from tomoskin.calibration.locator.presses import Presses
from tomoskin.calibration.locator.rubbing import Rubbing, quiet_electrodes
from tomoskin.calibration.locator.session import SessionAlignment
from tomoskin.calibration.locator.watch import Watch
from tomoskin.calibration.several import Several
from tomoskin.calibration.touch import TOUCH
from tomoskin.calibration.weighing.identify import MaterialFit, identify
from tomoskin.calibration.weighing.measured import ForceProcess
from tomoskin.calibration.weighing.model import ForceModel, LabelRemark, PressedSpots
from tomoskin.calibration.weighing.presses import WeighedPresses
from tomoskin.calibration.weighing.report import ForceReport, least_known
from tomoskin.calibration.weighing.weights import NEWTONS, Weight
from tomoskin.core import DataError, StrPath, load_arrays

KINDS: tuple[Kind[Any], ...] = (TOUCH, FORCE, BENDS, CLASSES)
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
    return kind.learn(arrays, str(path), progress)


__all__ = [
    "BENDS",
    "CLASSES",
    "FORCE",
    "KINDS",
    "NEWTONS",
    "TOUCH",
    "Alignment",
    "Answers",
    "Applied",
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
    "Conditions",
    "Differences",
    "Examples",
    "ForceModel",
    "ForceProcess",
    "ForceReport",
    "FrameClassifier",
    "FrameView",
    "JointReference",
    "Kind",
    "LabelRemark",
    "LeftOut",
    "Locator",
    "MappingAnswer",
    "MaterialFit",
    "PressedSpots",
    "Presses",
    "Rubbing",
    "SessionAlignment",
    "Several",
    "TouchFit",
    "Watch",
    "WeighedPresses",
    "Weight",
    "against_rest",
    "identify",
    "least_known",
    "load_calibration",
    "quiet_electrodes",
    "ring_of",
    "solve_channel_mapping",
]


def __getattr__(name: str) -> Any:
    return moved("calibration", name)
