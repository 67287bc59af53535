"""Touches fitted to voltages by their parameters, with the exact forward model."""

from tomoskin.touch.fit.bound import (
    detection_bound,
    fisher_information,
    least_content,
    position_bound,
)
from tomoskin.touch.fit.noise import Whitener, row_covariance
from tomoskin.touch.fit.spot import Response, Spots, depth_of, spots_of

__all__ = [
    "Response",
    "Spots",
    "Whitener",
    "depth_of",
    "detection_bound",
    "fisher_information",
    "least_content",
    "position_bound",
    "row_covariance",
    "spots_of",
]
