"""What a force model says of itself, in figures and words; where the next press tells most."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tomoskin.core import FloatArray
from tomoskin.learning.force.curve import basis
from tomoskin.learning.force.model import ForceModel, LabelRemark


@dataclass(frozen=True)
class ForceReport:
    """How well labelled touches are weighed, each with its press left out.

    Attributes
    ----------
    touches, presses
        How many were labelled.
    from_n, to_n
        Smallest and largest force, N.
    mean_error, median_error
        Relative errors of the forces.
    held
        Part of the forces that lie in their own 90 % intervals.
    memory
        Whether the sheet was found to remember.
    remarks
        What is wrong with labels.
    """

    touches: int
    presses: int
    from_n: float
    to_n: float
    mean_error: float
    median_error: float
    held: float
    memory: bool
    remarks: tuple[LabelRemark, ...]

    @classmethod
    def of(cls, model: ForceModel) -> ForceReport:
        """Of a model that has learnt."""
        rows = model.presses.labelled
        errors, force = np.abs(model.errors), model.presses.force[rows]
        return cls(
            touches=len(rows),
            presses=len(np.unique(model.presses.press[rows])),
            from_n=float(force.min()),
            to_n=float(force.max()),
            mean_error=float(errors.mean()),
            median_error=float(np.median(errors)),
            held=model.held,
            memory=bool(model.memory.play),
            remarks=model.remarks,
        )

    @property
    def text(self) -> str:
        """In a sentence."""
        return (
            f"{self.touches} touches of {self.presses} presses, {self.from_n:.2g} to "
            f"{self.to_n:.2g} N; left out of the learning their forces are missed by "
            f"{100 * self.mean_error:.0f} % (median {100 * self.median_error:.0f} %), and "
            f"their 90 % intervals hold {100 * self.held:.0f} %"
        )


def least_known(model: ForceModel, xy: FloatArray) -> FloatArray:
    """(2,) m: that of the positions ``xy`` (n, 2) m at which a further press tells most.

    It is where the curve's level is least certain for a touch of the usual size.
    """
    curve = model.curve
    terms = basis(xy, np.zeros(len(xy)), model.unit)
    levels = terms @ curve.mean.T
    own = ((terms @ curve.covariance) * terms).sum(axis=2).T
    middle = levels @ curve.weight
    variance = (own + (levels - middle[:, None]) ** 2) @ curve.weight
    return np.asarray(xy[int(np.argmax(variance))])
