"""What is learnt from examples: touch positions, classes, bends, channel mapping."""

from tomoskin.calibration.bending.examples import BendExamples
from tomoskin.calibration.bending.joint import JointReference
from tomoskin.calibration.bending.model import BendModel
from tomoskin.calibration.bending.reader import BendReader, BendReading
from tomoskin.calibration.bends_file import (
    BENDS_FILE,
    BendCalibration,
    pack_bends,
    read_bends,
    unpack_bends,
    write_bends,
)
from tomoskin.calibration.channel_mapping.solve import WiringAnswer, solve_wiring
from tomoskin.calibration.channel_mapping.wiring import Wiring, ring_of
from tomoskin.calibration.classes.classifier import Answers, StateClassifier
from tomoskin.calibration.classes.codes import Codes
from tomoskin.calibration.classes.examples import Examples
from tomoskin.calibration.classes.rest import against_rest
from tomoskin.calibration.classes.teller import StateReading, Teller
from tomoskin.calibration.classes_file import (
    STATES_FILE,
    StatesCalibration,
    pack_states,
    read_states,
    unpack_states,
    write_states,
)
from tomoskin.calibration.locator.locator import Locator
from tomoskin.calibration.locator.presses import Presses
from tomoskin.calibration.locator.watch import Watch
from tomoskin.calibration.several import Several
from tomoskin.calibration.touch_file import (
    CALIBRATION_FILE,
    Calibration,
    pack_calibration,
    read_calibration,
    unpack_calibration,
    write_calibration,
)

__all__ = [
    "BENDS_FILE",
    "CALIBRATION_FILE",
    "STATES_FILE",
    "Answers",
    "BendCalibration",
    "BendExamples",
    "BendModel",
    "BendReader",
    "BendReading",
    "Calibration",
    "Codes",
    "Examples",
    "JointReference",
    "Locator",
    "Presses",
    "Several",
    "StateClassifier",
    "StateReading",
    "StatesCalibration",
    "Teller",
    "Watch",
    "Wiring",
    "WiringAnswer",
    "against_rest",
    "pack_bends",
    "pack_calibration",
    "pack_states",
    "read_bends",
    "read_calibration",
    "read_states",
    "ring_of",
    "solve_wiring",
    "unpack_bends",
    "unpack_calibration",
    "unpack_states",
    "write_bends",
    "write_calibration",
    "write_states",
]
