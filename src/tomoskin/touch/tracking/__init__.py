"""Readings of successive frames → touches that keep their identity, and what happens to them."""

from tomoskin.touch.tracking.event import TouchEvent
from tomoskin.touch.tracking.motion import HELD, STILL, TrackSettings
from tomoskin.touch.tracking.tracker import Tracker

__all__ = ["HELD", "STILL", "TouchEvent", "TrackSettings", "Tracker"]
