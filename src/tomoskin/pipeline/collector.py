"""The reference in the making: the first frames of an untouched skin."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tomoskin.core import FloatArray
from tomoskin.signal import Reference


class Collector:
    """Takes frames until there are enough for a reference with its noise.

    A row that was unusable in any of them, or that read exactly zero in all, has no reference:
    it takes the model's value, so that nothing downstream meets a NaN or divides by zero, and
    stays in :attr:`unusable`.

    Parameters
    ----------
    needed
        Frames that make a reference.
    model
        (n_meas,) V, what the model expects of the untouched skin.
    least
        V below which no row's noise is: a converter that does not flicker rounds all the same.
    """

    def __init__(self, needed: int, model: FloatArray, least: float = 0.0) -> None:
        self._rows = np.empty((needed, len(model)))
        self._model, self._least = model, least
        self.taken = 0
        self.unusable: NDArray[np.bool_] = np.zeros(len(model), dtype=bool)

    @property
    def needed(self) -> int:
        """Frames that make a reference."""
        return len(self._rows)

    @property
    def done(self) -> bool:
        """Whether there are enough."""
        return self.taken == self.needed

    def add(self, values: FloatArray, unusable: NDArray[np.bool_]) -> None:
        """Take one frame: (n_meas,) V and the rows of it that cannot be used."""
        self._rows[self.taken] = np.where(unusable, self._model, values)
        self.unusable |= unusable
        self.taken += 1

    def reference(self) -> Reference:
        """Mean and noise of the frames taken."""
        self.unusable |= ~self._rows[: self.taken].any(axis=0)
        self._rows[:, self.unusable] = self._model[self.unusable]
        return Reference.of(self._rows[: self.taken], self._least)
