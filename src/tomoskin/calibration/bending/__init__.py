"""Bends told apart from touches: their directions in the data, their angle, their references."""

from tomoskin.calibration.bending.examples import BendExamples
from tomoskin.calibration.bending.joint import JointReference
from tomoskin.calibration.bending.model import BendModel
from tomoskin.calibration.bending.reader import BendReader, BendReading

__all__ = ["BendExamples", "BendModel", "BendReader", "BendReading", "JointReference"]
