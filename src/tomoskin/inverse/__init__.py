"""From a change of voltages to a change of conductivity."""

from tomoskin.inverse.one_step import OneStep
from tomoskin.inverse.priors import PRIORS, prior_matrix

__all__ = ["PRIORS", "OneStep", "prior_matrix"]
