"""Touches fitted to voltages by their parameters, with the exact forward model."""

from tomoskin.sensing.fit.bounds import (
    Demand,
    ResolutionBounds,
    position_bound,
    resolution_bounds,
    variants,
)
from tomoskin.sensing.fit.drive_evidence import DriveEvidence, Initiation, Onset
from tomoskin.sensing.fit.drive_filter import DriveFilter, MovingTouch
from tomoskin.sensing.fit.drive_view import DriveView, NoiseKey
from tomoskin.sensing.fit.finder import SpotFinder
from tomoskin.sensing.fit.noise import (
    Whitener,
    common_mode_variance,
    idle_covariance,
    measured_covariance,
    row_covariance,
)
from tomoskin.sensing.fit.policy import EXHAUSTIVE, LIVE, Pace
from tomoskin.sensing.fit.spot import Response, Spots, spots_of
from tomoskin.sensing.fit.spot_fit import SpotPrior
from tomoskin.sensing.fit.spot_model import SpotModel

__all__ = [
    "EXHAUSTIVE",
    "LIVE",
    "Demand",
    "DriveEvidence",
    "DriveFilter",
    "DriveView",
    "Initiation",
    "MovingTouch",
    "NoiseKey",
    "Onset",
    "Pace",
    "ResolutionBounds",
    "Response",
    "SpotFinder",
    "SpotModel",
    "SpotPrior",
    "Spots",
    "Whitener",
    "common_mode_variance",
    "idle_covariance",
    "measured_covariance",
    "position_bound",
    "resolution_bounds",
    "row_covariance",
    "spots_of",
    "variants",
]
