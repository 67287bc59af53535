"""Counts → voltages → differences, with the noise of an idle skin."""

from tomoskin.signal.consecutive import Consecutive, at_one_time
from tomoskin.signal.difference import DIFFERENCES, difference, difference_noise
from tomoskin.signal.phase import in_phase
from tomoskin.signal.readout import Readout
from tomoskin.signal.reference import Reference

__all__ = [
    "DIFFERENCES",
    "Consecutive",
    "Readout",
    "Reference",
    "at_one_time",
    "difference",
    "difference_noise",
    "in_phase",
]
