"""From a change of voltages to a change of conductivity."""

from typing import Any

from tomoskin._moved import moved
from tomoskin.inverse.choice.alpha_choice import AlphaChoice, Curve, Evidence
from tomoskin.inverse.choice.criteria import RULES, choose
from tomoskin.inverse.choice.light_touch import LightTouch
from tomoskin.inverse.dispersion import Cole, Regions, cole_of_regions
from tomoskin.inverse.frequency_difference import (
    FrequencyDifference,
    simple_change,
    weighted_change,
)
from tomoskin.inverse.greit.merit import Merit, figures, noise_figure
from tomoskin.inverse.greit.targets import Targets, along
from tomoskin.inverse.greit.trainer import Desired, Greit
from tomoskin.inverse.iterative.absolute import Absolute, AbsoluteImaging, homogeneous
from tomoskin.inverse.iterative.observation import Observation
from tomoskin.inverse.iterative.shapes import RandomField, Segmented, ShapeImaging
from tomoskin.inverse.iterative.sharp_difference import SharpDifference, SharpImage
from tomoskin.inverse.linear.images import MOST_EXCLUDED, ImageSeries, image_series
from tomoskin.inverse.linear.modes import Modes
from tomoskin.inverse.linear.one_step import OneStep
from tomoskin.inverse.linear.operator import Operator
from tomoskin.inverse.linear.problem import LinearProblem, noise_weights
from tomoskin.inverse.linear.spectrum import Assembly, Spectrum
from tomoskin.inverse.linear.temporal import Smoothed, Smoother, Steady, Temporal
from tomoskin.inverse.priors.named import (
    PRIORS,
    Identity,
    Noser,
    Prior,
    SharpPrior,
    Sparse,
    TotalVariation,
    named_prior,
    prior_matrix,
)
from tomoskin.inverse.priors.smooth import GaussianHighPass, Laplace, Matern, Structural
from tomoskin.inverse.resolution import (
    Picard,
    averaging,
    condition_number,
    picard,
    point_spread,
    resolution_matrix,
    resolved,
    sensitivity,
    unresolved,
)
from tomoskin.inverse.similarity import SimilarityWindows
from tomoskin.inverse.thesis_metrics import ThesisMetrics

__all__ = [
    "MOST_EXCLUDED",
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
    "ImageSeries",
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
    "Prior",
    "RandomField",
    "Regions",
    "Segmented",
    "ShapeImaging",
    "SharpDifference",
    "SharpImage",
    "SharpPrior",
    "SimilarityWindows",
    "Smoothed",
    "Smoother",
    "Sparse",
    "Spectrum",
    "Steady",
    "Structural",
    "Targets",
    "Temporal",
    "ThesisMetrics",
    "TotalVariation",
    "along",
    "averaging",
    "choose",
    "cole_of_regions",
    "condition_number",
    "figures",
    "homogeneous",
    "image_series",
    "named_prior",
    "noise_figure",
    "noise_weights",
    "picard",
    "point_spread",
    "prior_matrix",
    "resolution_matrix",
    "resolved",
    "sensitivity",
    "simple_change",
    "unresolved",
    "weighted_change",
]


def __getattr__(name: str) -> Any:
    return moved("inverse", name)
