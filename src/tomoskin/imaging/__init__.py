"""From a change of voltages to a change of conductivity."""

from tomoskin.imaging.choice import (
    RULES as RULES,
    AlphaChoice as AlphaChoice,
    Curve as Curve,
    LightTouch as LightTouch,
    choose as choose,
    for_recording as for_recording,
)
from tomoskin.imaging.iterative.absolute import (
    Absolute as Absolute,
    AbsoluteImaging as AbsoluteImaging,
    SharpDifference as SharpDifference,
    homogeneous as homogeneous,
)
from tomoskin.imaging.iterative.shapes import (
    RandomField as RandomField,
    Segmented as Segmented,
    ShapeImaging as ShapeImaging,
)
from tomoskin.imaging.iterative.unknowns import Observation as Observation
from tomoskin.imaging.linear.linear_problem import (
    LinearProblem as LinearProblem,
    OneStep as OneStep,
)
from tomoskin.imaging.linear.operator import MOST_EXCLUDED as MOST_EXCLUDED, Operator as Operator
from tomoskin.imaging.linear.spectrum import Spectrum as Spectrum
from tomoskin.imaging.linear.temporal import Modes as Modes, Temporal as Temporal
from tomoskin.imaging.resolution import (
    Picard as Picard,
    disc_means as disc_means,
    picard as picard,
    unresolved as unresolved,
)
from tomoskin.imaging.trained.merit import (
    Merit as Merit,
    Targets as Targets,
    ThesisMetrics as ThesisMetrics,
    along as along,
    figures as figures,
    noise_figure as noise_figure,
)
from tomoskin.imaging.trained.trainer import Greit as Greit
