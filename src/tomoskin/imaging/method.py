"""What else than one step may make an image of data: registered at the seam "methods"."""

from __future__ import annotations

from typing import ClassVar, Protocol

from tomoskin.core import FloatArray
from tomoskin.imaging.choice import AlphaChoice
from tomoskin.imaging.linear.operator import Operator
from tomoskin.model.forward import ForwardModel

Chosen = tuple[AlphaChoice, Operator]
"""What takes the place of alpha, and the operator."""


class Method(Protocol):
    """A frozen record by which ``[inverse] method`` names its operator. Its fields made by
    :func:`tomoskin.model.section.key` are keys of that section too.

    Attributes
    ----------
    meaning
        What the operator does, a sentence for the documentation of the key.
    """

    meaning: ClassVar[str]

    def operator(self, model: ForwardModel, conductivity: float, difference: str) -> Chosen:
        """Of a sheet of even ``conductivity``, for "plain" or "normalised" differences."""
        ...

    def for_recording(self, operator: Operator, weights: FloatArray) -> Chosen | None:
        """The same made for a recording of a board that is not known, whose rows have these
        ``weights`` (n_meas,); None where the ``operator`` stays as it is."""
        ...
