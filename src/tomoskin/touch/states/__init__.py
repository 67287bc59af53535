"""What state a frame shows, learnt from labelled examples: one of several, or several flags."""

from tomoskin.touch.states.classifier import Answers, StateClassifier
from tomoskin.touch.states.codes import Codes
from tomoskin.touch.states.examples import Examples
from tomoskin.touch.states.rest import against_rest
from tomoskin.touch.states.teller import StateReading, Teller

__all__ = [
    "Answers",
    "Codes",
    "Examples",
    "StateClassifier",
    "StateReading",
    "Teller",
    "against_rest",
]
