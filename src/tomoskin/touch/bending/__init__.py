"""Bends told apart from touches: their directions in the data, their angle, their references."""

from tomoskin.touch.bending.examples import BendExamples
from tomoskin.touch.bending.joint import JointReference
from tomoskin.touch.bending.model import BendModel
from tomoskin.touch.bending.reader import BendReader, BendReading

__all__ = ["BendExamples", "BendModel", "BendReader", "BendReading", "JointReference"]
