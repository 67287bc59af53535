"""Counts → voltages → differences, with the noise of an idle skin."""

from tomoskin.signal.difference import DIFFERENCES, difference
from tomoskin.signal.phase import in_phase
from tomoskin.signal.readout import Readout
from tomoskin.signal.reference import Reference

__all__ = ["DIFFERENCES", "Readout", "Reference", "difference", "in_phase"]
