"""Detections of successive frames → touches that keep their identity, and what happens to them."""

from tomoskin.sensing.track.motion import SlideCorrection, TrackSettings
from tomoskin.sensing.track.policy import GATE, HELD, RESIDUAL
from tomoskin.sensing.track.touch_table import (
    ELAPSED,
    Measurands,
    Span,
    TouchedFrame,
    amount_values,
    columns_of,
    measured_in,
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
    "Measurands",
    "SlideCorrection",
    "Span",
    "TouchEvent",
    "TouchedFrame",
    "TrackSettings",
    "Tracker",
    "amount_values",
    "columns_of",
    "measured_in",
    "touch_columns",
    "touch_rows",
    "touch_spans",
]
