"""Touches fitted to voltages by their parameters, with the exact forward model."""

from tomoskin.sensing.fit.bound import position_bound as position_bound
from tomoskin.sensing.fit.deformation import (
    Deformation as Deformation,
    EstimatedNumber as EstimatedNumber,
)
from tomoskin.sensing.fit.drive_evidence import (
    DriveEvidence as DriveEvidence,
    DriveFilter as DriveFilter,
    Initiation as Initiation,
    MovingTouch as MovingTouch,
    Onset as Onset,
)
from tomoskin.sensing.fit.finder import SpotFinder as SpotFinder
from tomoskin.sensing.fit.noise import (
    Whitener as Whitener,
    common_mode_variance as common_mode_variance,
    idle_covariance as idle_covariance,
    measured_covariance as measured_covariance,
    row_covariance as row_covariance,
)
from tomoskin.sensing.fit.policy import EXHAUSTIVE as EXHAUSTIVE, LIVE as LIVE, Pace as Pace
from tomoskin.sensing.fit.sight import DriveView as DriveView, NoiseKey as NoiseKey
from tomoskin.sensing.fit.spot import (
    CONTENT as CONTENT,
    N_PARAMETERS as N_PARAMETERS,
    Response as Response,
    Spots as Spots,
    spots_of as spots_of,
)
from tomoskin.sensing.fit.spot_fit import SpotPrior as SpotPrior
from tomoskin.sensing.fit.spot_model import SpotModel as SpotModel
