"""Image → readings → touches with an identity; labelled presses → places."""

from tomoskin.touch.floor import NoiseFloor
from tomoskin.touch.locator import Locator, Presses, Region
from tomoskin.touch.segment import Segmenter
from tomoskin.touch.states import Answers, Codes, Examples, StateClassifier, against_rest
from tomoskin.touch.track import Tracker

__all__ = [
    "Answers",
    "Codes",
    "Examples",
    "Locator",
    "NoiseFloor",
    "Presses",
    "Region",
    "Segmenter",
    "StateClassifier",
    "Tracker",
    "against_rest",
]
