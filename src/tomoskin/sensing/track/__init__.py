"""Detections of successive frames → touches that keep their identity, and what happens to them."""

from tomoskin.sensing.track.motion import SlideCorrection, TrackSettings, motion_step
from tomoskin.sensing.track.policy import GATE, HELD, RESIDUAL
from tomoskin.sensing.track.touch_table import (
    ELAPSED,
    Span,
    TouchedFrame,
    columns_of,
    force_values,
    has_forces,
    touch_columns,
    touch_rows,
    touch_spans,
)
from tomoskin.sensing.track.trace import TouchEvent
from tomoskin.sensing.track.tracker import Tracker

__all__ = [
    "ELAPSED",
    "GATE",
    "HELD",
    "RESIDUAL",
    "SlideCorrection",
    "Span",
    "TouchEvent",
    "TouchedFrame",
    "TrackSettings",
    "Tracker",
    "columns_of",
    "force_values",
    "has_forces",
    "motion_step",
    "touch_columns",
    "touch_rows",
    "touch_spans",
]
