"""Image → readings → touches with an identity."""

from tomoskin.touch.floor import NoiseFloor
from tomoskin.touch.segment import Segmenter
from tomoskin.touch.track import Tracker

__all__ = ["NoiseFloor", "Segmenter", "Tracker"]
