"""What state one frame after the other shows, as the frames come in."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Self

import numpy as np

from tomoskin.calibration.classes.classifier import StateClassifier
from tomoskin.core import FloatArray, IntArray


@dataclass(frozen=True, slots=True)
class StateReading:
    """What one frame shows.

    Attributes
    ----------
    name
        The state, or the flags that are set; the nearest where it is ``unknown``.
    probability
        Of that state among those that were learnt.
    unknown
        Whether the frame looks like none of them.
    """

    name: str
    probability: float
    unknown: bool

    @property
    def text(self) -> str:
        """For people."""
        if self.unknown:
            return f"unknown state (nearest: {self.name})"
        return f"{self.name} {100 * self.probability:.0f} %"


@dataclass(frozen=True, eq=False)
class Teller:
    """A classifier for the frames of one skin, of which some rows may be left out for good.

    Attributes
    ----------
    classifier
        What was learnt, of all rows.
    rows
        (n_meas,) the classifier's row of each row of a frame.
    """

    classifier: StateClassifier
    rows: IntArray

    @classmethod
    def of(cls, classifier: StateClassifier) -> Self:
        """With all rows."""
        return cls(classifier, np.arange(classifier.examples.dv.shape[1]))

    def without(self, rows: IntArray) -> Self:
        """For frames that lack ``rows``."""
        return type(self)(self.classifier, np.delete(self.rows, rows))

    def __call__(self, change: FloatArray) -> StateReading:
        """Of a frame minus the reference, (n_meas,) V, NaN where a row says nothing."""
        whole = np.full(self.classifier.examples.dv.shape[1], np.nan)
        whole[self.rows] = change
        told = self.classifier.predict(whole[None])
        return StateReading(told.label[0], float(told.probability[0]), bool(told.rejected[0]))
