"""From a change of voltages to a change of conductivity."""

from tomoskin.imaging.choice.alpha_choice import AlphaChoice, Curve, Evidence
from tomoskin.imaging.choice.criteria import RULES, choose
from tomoskin.imaging.choice.light_touch import LightTouch
from tomoskin.imaging.dispersion import Cole, Regions, cole_of_regions
from tomoskin.imaging.frequency_difference import (
    FrequencyDifference,
    simple_change,
    weighted_change,
)
from tomoskin.imaging.iterative.absolute import Absolute, AbsoluteImaging, homogeneous
from tomoskin.imaging.iterative.observation import Observation
from tomoskin.imaging.iterative.shapes import RandomField, Segmented, ShapeImaging
from tomoskin.imaging.iterative.sharp_difference import SharpDifference, SharpImage
from tomoskin.imaging.linear.images import MOST_EXCLUDED, ImageSeries, image_series
from tomoskin.imaging.linear.modes import Modes
from tomoskin.imaging.linear.one_step import OneStep
from tomoskin.imaging.linear.operator import Operator
from tomoskin.imaging.linear.problem import LinearProblem, noise_weights
from tomoskin.imaging.linear.spectrum import Assembly, Spectrum
from tomoskin.imaging.linear.temporal import Smoothed, Smoother, Steady, Temporal
from tomoskin.imaging.resolution import (
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
from tomoskin.imaging.similarity import SimilarityWindows
from tomoskin.imaging.thesis_metrics import ThesisMetrics
from tomoskin.imaging.trained.merit import Merit, figures, noise_figure
from tomoskin.imaging.trained.targets import Targets, along
from tomoskin.imaging.trained.trainer import Desired, Greit
from tomoskin.model.prior import (
    PRIORS,
    GaussianHighPass,
    Identity,
    Laplace,
    Matern,
    Noser,
    Prior,
    SharpPrior,
    Sparse,
    Structural,
    TotalVariation,
    prior_matrix,
)

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
