"""From a change of voltages to a change of conductivity."""

from tomoskin.imaging.choice.alpha_choice import AlphaChoice, Curve, Evidence
from tomoskin.imaging.choice.criteria import RULES, choose, for_recording
from tomoskin.imaging.choice.light_touch import LightTouch
from tomoskin.imaging.iterative.absolute import Absolute, AbsoluteImaging, homogeneous
from tomoskin.imaging.iterative.observation import Observation
from tomoskin.imaging.iterative.shapes import RandomField, Segmented, ShapeImaging
from tomoskin.imaging.iterative.sharp_difference import SharpDifference, SharpImage
from tomoskin.imaging.linear.linear_problem import LinearProblem, OneStep
from tomoskin.imaging.linear.operator import MOST_EXCLUDED, Operator
from tomoskin.imaging.linear.spectrum import Assembly, Spectrum
from tomoskin.imaging.linear.temporal import Modes, Steady, Temporal
from tomoskin.imaging.resolution import (
    Picard,
    picard,
    unresolved,
)
from tomoskin.imaging.trained.merit import Merit, ThesisMetrics, figures, noise_figure
from tomoskin.imaging.trained.targets import Targets, along
from tomoskin.imaging.trained.trainer import Greit
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
    "Curve",
    "Evidence",
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
    "Prior",
    "RandomField",
    "Segmented",
    "ShapeImaging",
    "SharpDifference",
    "SharpImage",
    "SharpPrior",
    "Sparse",
    "Spectrum",
    "Steady",
    "Structural",
    "Targets",
    "Temporal",
    "ThesisMetrics",
    "TotalVariation",
    "along",
    "choose",
    "figures",
    "for_recording",
    "homogeneous",
    "noise_figure",
    "picard",
    "prior_matrix",
    "unresolved",
]
