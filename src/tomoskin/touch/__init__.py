"""Image → readings → touches with an identity; labelled presses → places."""

from tomoskin.touch.bending import (
    BendExamples,
    BendModel,
    BendReader,
    BendReading,
    JointReference,
)
from tomoskin.touch.design import Demand, Promise, Variant, promise, variants
from tomoskin.touch.fit import LIVE, WHOLE, Pace, SpotFinder, SpotModel, measured_covariance
from tomoskin.touch.floor import NoiseFloor
from tomoskin.touch.locator import Locator, Presses, Region, Watch
from tomoskin.touch.segment import Segmenter
from tomoskin.touch.several import Several
from tomoskin.touch.states import (
    Answers,
    Codes,
    Examples,
    StateClassifier,
    StateReading,
    Teller,
    against_rest,
)
from tomoskin.touch.tracking import STILL, TouchEvent, Tracker, TrackSettings
from tomoskin.touch.wiring import Wiring, WiringAnswer, ring_of, solve_wiring

__all__ = [
    "LIVE",
    "STILL",
    "WHOLE",
    "Answers",
    "BendExamples",
    "BendModel",
    "BendReader",
    "BendReading",
    "Codes",
    "Demand",
    "Examples",
    "JointReference",
    "Locator",
    "NoiseFloor",
    "Pace",
    "Presses",
    "Promise",
    "Region",
    "Segmenter",
    "Several",
    "SpotFinder",
    "SpotModel",
    "StateClassifier",
    "StateReading",
    "Teller",
    "TouchEvent",
    "TrackSettings",
    "Tracker",
    "Variant",
    "Watch",
    "Wiring",
    "WiringAnswer",
    "against_rest",
    "measured_covariance",
    "promise",
    "ring_of",
    "solve_wiring",
    "variants",
]
