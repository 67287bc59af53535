"""Image → readings → touches with an identity; labelled presses → places."""

from tomoskin.touch.floor import NoiseFloor
from tomoskin.touch.locator import Locator, Presses, Region
from tomoskin.touch.segment import Segmenter
from tomoskin.touch.track import Tracker

__all__ = ["Locator", "NoiseFloor", "Presses", "Region", "Segmenter", "Tracker"]
