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
from tomoskin.imaging.linear.temporal import Modes, Temporal
from tomoskin.imaging.resolution import (
    Picard,
    disc_means,
    picard,
    unresolved,
)
from tomoskin.imaging.trained.merit import Merit, ThesisMetrics, figures, noise_figure
from tomoskin.imaging.trained.targets import Targets, along
from tomoskin.imaging.trained.trainer import Greit

__all__ = [
    "MOST_EXCLUDED",
    "RULES",
    "Absolute",
    "AbsoluteImaging",
    "AlphaChoice",
    "Assembly",
    "Curve",
    "Evidence",
    "Greit",
    "LightTouch",
    "LinearProblem",
    "Merit",
    "Modes",
    "Observation",
    "OneStep",
    "Operator",
    "Picard",
    "RandomField",
    "Segmented",
    "ShapeImaging",
    "SharpDifference",
    "SharpImage",
    "Spectrum",
    "Targets",
    "Temporal",
    "ThesisMetrics",
    "along",
    "choose",
    "disc_means",
    "figures",
    "for_recording",
    "homogeneous",
    "noise_figure",
    "picard",
    "unresolved",
]
