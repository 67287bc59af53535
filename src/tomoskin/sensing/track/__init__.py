"""Detections of successive frames → touches that keep their identity, and what happens to them."""

from tomoskin.sensing.track.motion import TrackSettings as TrackSettings, motion_step as motion_step
from tomoskin.sensing.track.policy import GATE as GATE, HELD as HELD, RESIDUAL as RESIDUAL
from tomoskin.sensing.track.rim import Rim as Rim
from tomoskin.sensing.track.sliding import (
    SlideCorrection as SlideCorrection,
    likeliest_lag as likeliest_lag,
)
from tomoskin.sensing.track.touch_table import (
    ELAPSED as ELAPSED,
    Measurands as Measurands,
    Span as Span,
    TouchedFrame as TouchedFrame,
    amount_values as amount_values,
    columns_of as columns_of,
    measured_in as measured_in,
    touch_columns as touch_columns,
    touch_rows as touch_rows,
    touch_spans as touch_spans,
)
from tomoskin.sensing.track.trace import TouchEvent as TouchEvent
from tomoskin.sensing.track.tracker import Tracker as Tracker
