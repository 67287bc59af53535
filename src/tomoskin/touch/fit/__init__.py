"""Touches fitted to voltages by their parameters, with the exact forward model."""

from tomoskin.touch.fit.bound import (
    detection_bound,
    fisher_information,
    least_content,
    position_bound,
)
from tomoskin.touch.fit.covariance import idle_covariance
from tomoskin.touch.fit.finder import SpotFinder, SpotModel
from tomoskin.touch.fit.noise import Whitener, measured_covariance, row_covariance
from tomoskin.touch.fit.pace import EXHAUSTIVE, LIVE, Pace
from tomoskin.touch.fit.spot import Response, Spots, depth_of, spots_of

__all__ = [
    "EXHAUSTIVE",
    "LIVE",
    "Pace",
    "Response",
    "SpotFinder",
    "SpotModel",
    "Spots",
    "Whitener",
    "depth_of",
    "detection_bound",
    "fisher_information",
    "idle_covariance",
    "least_content",
    "measured_covariance",
    "position_bound",
    "row_covariance",
    "spots_of",
]
