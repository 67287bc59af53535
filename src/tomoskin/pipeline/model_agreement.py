"""Whether a reference can be that of a skin: its pattern and size beside the model's voltages."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Self

import numpy as np

from tomoskin.core import FloatArray

REFUSED = 0.3
DOUBTED = 0.8
"""Cosine below which a recording is refused as another skin's, and below which it is doubted. Real
recordings with the right skin have 0.33 to 0.998; another shape or order 0.73 to −0.1."""

_MOST_SIZE = 3.0
"""Voltages in V are doubted where they differ from the model's by more than this factor: a skin of
the same pattern and another resistance or current shows in nothing else."""


@dataclass(frozen=True, slots=True)
class ModelAgreement:
    """A reference beside the voltages that a skin's model expects; NaN where there is none.

    Attributes
    ----------
    cosine
        Of the angle between them: 1 where they are proportional.
    size
        Norm of the reference as a part of the model's.
    """

    cosine: float = math.nan
    size: float = math.nan

    @classmethod
    def of(cls, reference: FloatArray, model: FloatArray) -> Self:
        """Of two vectors (n_meas,)."""
        length, expected = float(np.linalg.norm(reference)), float(np.linalg.norm(model))
        if not length or not expected:
            return cls(0.0, length / expected if expected else 0.0)
        return cls(float(reference @ model) / (length * expected), length / expected)

    @property
    def text(self) -> str:
        """How well they agree."""
        return (
            f"the reference agrees with the skin's model by {self.cosine:.3f} (1 = "
            f"proportional), at {self.size:.3g} times its size"
        )

    def doubt(self, *, volts: bool) -> str | None:
        """What to look at, in a sentence, or None; ``volts``: whether the size can be meant."""
        if math.isnan(self.cosine):  # there is no reference yet
            return None
        if self.cosine < DOUBTED:
            return f"{self.text}: check the skin and the order of the electrodes"
        if volts and not 1 / _MOST_SIZE < self.size < _MOST_SIZE:
            return f"{self.text}: check the skin, its current and its sheet resistance"
        return None


NO_AGREEMENT = ModelAgreement()
"""Where there is no reference."""
