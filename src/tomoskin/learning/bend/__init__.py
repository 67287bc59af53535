"""Bends told apart from touches: their directions in the data, their angle, their references."""

from tomoskin.learning.bend.examples import BendExamples, JointReference
from tomoskin.learning.bend.kind import BendReader, BendReading
from tomoskin.learning.bend.model import BendModel

__all__ = ["BendExamples", "BendModel", "BendReader", "BendReading", "JointReference"]
