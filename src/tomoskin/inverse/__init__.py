"""From a change of voltages to a change of conductivity."""

from tomoskin.inverse.absolute import Absolute, AbsoluteImaging, homogeneous
from tomoskin.inverse.assembly import Assembly
from tomoskin.inverse.choice import AlphaChoice, Curve, Evidence
from tomoskin.inverse.cole import Cole, cole_of_regions
from tomoskin.inverse.desired import Desired
from tomoskin.inverse.field import RandomField
from tomoskin.inverse.frequency_difference import (
    FrequencyDifference,
    simple_change,
    weighted_change,
)
from tomoskin.inverse.greit import Greit
from tomoskin.inverse.high_pass import GaussianHighPass
from tomoskin.inverse.laplace import Laplace, Structural
from tomoskin.inverse.light_touch import LightTouch
from tomoskin.inverse.matern import Matern
from tomoskin.inverse.merit import Merit, figures
from tomoskin.inverse.modes import Modes
from tomoskin.inverse.noise_figure import noise_figure
from tomoskin.inverse.observation import Observation
from tomoskin.inverse.one_step import OneStep
from tomoskin.inverse.operator import Operator
from tomoskin.inverse.picard import Picard, picard
from tomoskin.inverse.pictures import MOST_LEFT_OUT, Pictures, pictures
from tomoskin.inverse.priors import PRIORS, Identity, Noser, Prior, named_prior, prior_matrix
from tomoskin.inverse.problem import LinearProblem
from tomoskin.inverse.regions import Regions
from tomoskin.inverse.resolution import (
    averaging,
    condition_number,
    point_spread,
    resolution_matrix,
    resolved,
    sensitivity,
)
from tomoskin.inverse.rules import RULES, choose
from tomoskin.inverse.shapes import Segmented, ShapeImaging
from tomoskin.inverse.sharp_difference import SharpDifference, SharpImage
from tomoskin.inverse.smoother import Smoothed, Smoother
from tomoskin.inverse.source_metrics import SourceMetrics
from tomoskin.inverse.spectrum import Spectrum
from tomoskin.inverse.targets import Targets, along
from tomoskin.inverse.temporal import Steady, Temporal
from tomoskin.inverse.total_variation import SharpPrior, Sparse, TotalVariation
from tomoskin.inverse.weights import noise_weights

__all__ = [
    "MOST_LEFT_OUT",
    "PRIORS",
    "RULES",
    "Absolute",
    "AbsoluteImaging",
    "AlphaChoice",
    "Assembly",
    "Cole",
    "Curve",
    "Desired",
    "Evidence",
    "FrequencyDifference",
    "GaussianHighPass",
    "Greit",
    "Identity",
    "Laplace",
    "LightTouch",
    "LinearProblem",
    "Matern",
    "Merit",
    "Modes",
    "Noser",
    "Observation",
    "OneStep",
    "Operator",
    "Picard",
    "Pictures",
    "Prior",
    "RandomField",
    "Regions",
    "Segmented",
    "ShapeImaging",
    "SharpDifference",
    "SharpImage",
    "SharpPrior",
    "Smoothed",
    "Smoother",
    "SourceMetrics",
    "Sparse",
    "Spectrum",
    "Steady",
    "Structural",
    "Targets",
    "Temporal",
    "TotalVariation",
    "along",
    "averaging",
    "choose",
    "cole_of_regions",
    "condition_number",
    "figures",
    "homogeneous",
    "named_prior",
    "noise_figure",
    "noise_weights",
    "picard",
    "pictures",
    "point_spread",
    "prior_matrix",
    "resolution_matrix",
    "resolved",
    "sensitivity",
    "simple_change",
    "weighted_change",
]
