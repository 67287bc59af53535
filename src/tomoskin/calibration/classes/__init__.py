"""What state a frame shows, learnt from labelled examples: one of several, or several flags."""

from tomoskin.calibration.classes.classifier import Answers, StateClassifier
from tomoskin.calibration.classes.codes import Codes
from tomoskin.calibration.classes.examples import Examples
from tomoskin.calibration.classes.rest import against_rest
from tomoskin.calibration.classes.teller import StateReading, Teller

__all__ = [
    "Answers",
    "Codes",
    "Examples",
    "StateClassifier",
    "StateReading",
    "Teller",
    "against_rest",
]
