"""From a change of voltages to a change of conductivity."""

from tomoskin.inverse.one_step import OneStep
from tomoskin.inverse.operator import Operator
from tomoskin.inverse.priors import (
    PRIORS,
    GaussianHighPass,
    Identity,
    Laplace,
    Noser,
    Prior,
    prior_matrix,
)
from tomoskin.inverse.problem import LinearProblem
from tomoskin.inverse.spectrum import Spectrum

__all__ = [
    "PRIORS",
    "GaussianHighPass",
    "Identity",
    "Laplace",
    "LinearProblem",
    "Noser",
    "OneStep",
    "Operator",
    "Prior",
    "Spectrum",
    "prior_matrix",
]
