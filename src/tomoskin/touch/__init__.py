"""Difference data or an image → detections → touches with an identity; bounds of a design."""

from typing import Any

from tomoskin._moved import moved
from tomoskin.touch.bounds import Demand, ResolutionBounds, Variant, resolution_bounds, variants
from tomoskin.touch.fit.covariance import idle_covariance
from tomoskin.touch.fit.finder import SpotFinder, SpotModel
from tomoskin.touch.fit.noise import Whitener, measured_covariance
from tomoskin.touch.fit.pace import EXHAUSTIVE, LIVE, Pace
from tomoskin.touch.fit.prior import SpotPrior
from tomoskin.touch.fit.spot import Response, Spots, spots_of
from tomoskin.touch.region import Region
from tomoskin.touch.segment import ImageNoise, Segmenter
from tomoskin.touch.sliding import FingerTracker, SlideCorrection
from tomoskin.touch.spans import Span, touch_spans
from tomoskin.touch.table import (
    ELAPSED,
    TouchedFrame,
    columns_of,
    force_values,
    has_forces,
    touch_columns,
    touch_rows,
)
from tomoskin.touch.tracking.event import TouchEvent
from tomoskin.touch.tracking.motion import STILL, TrackSettings
from tomoskin.touch.tracking.tracker import Tracker

__all__ = [
    "ELAPSED",
    "EXHAUSTIVE",
    "LIVE",
    "STILL",
    "Demand",
    "FingerTracker",
    "ImageNoise",
    "Pace",
    "Region",
    "ResolutionBounds",
    "Response",
    "Segmenter",
    "SlideCorrection",
    "Span",
    "SpotFinder",
    "SpotModel",
    "SpotPrior",
    "Spots",
    "TouchEvent",
    "TouchedFrame",
    "TrackSettings",
    "Tracker",
    "Variant",
    "Whitener",
    "columns_of",
    "force_values",
    "has_forces",
    "idle_covariance",
    "measured_covariance",
    "resolution_bounds",
    "spots_of",
    "touch_columns",
    "touch_rows",
    "touch_spans",
    "variants",
]


def __getattr__(name: str) -> Any:
    return moved("touch", name)
