"""Bends told apart from touches: their directions in the data, their angle, their references."""

from tomoskin.learning.bend.examples import BendExamples
from tomoskin.learning.bend.joint import JointReference
from tomoskin.learning.bend.model import BendModel
from tomoskin.learning.bend.reader import BendReader, BendReading

__all__ = ["BendExamples", "BendModel", "BendReader", "BendReading", "JointReference"]
