"""From a change of voltages to a change of conductivity."""

from tomoskin.imaging.choice import (
    RULES as RULES,
    AlphaChoice as AlphaChoice,
    Curve as Curve,
    LightTouch as LightTouch,
    choose as choose,
    for_recording as for_recording,
)
from tomoskin.imaging.linear.linear_problem import (
    LinearProblem as LinearProblem,
    OneStep as OneStep,
)
from tomoskin.imaging.linear.operator import MOST_EXCLUDED as MOST_EXCLUDED, Operator as Operator
from tomoskin.imaging.linear.spectrum import Spectrum as Spectrum
from tomoskin.imaging.linear.temporal import Modes as Modes, Temporal as Temporal
from tomoskin.imaging.method import Method as Method
from tomoskin.imaging.noise_figure import deviations as deviations, noise_figure as noise_figure
from tomoskin.imaging.resolution import (
    Picard as Picard,
    disc_means as disc_means,
    picard as picard,
    unresolved as unresolved,
)
