"""The first state of the pipeline: frames of the untouched skin become its reference."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tomoskin.core import FloatArray, Voltages
from tomoskin.pipeline.frame_result import NO_AGREEMENT, ModelAgreement
from tomoskin.sensing.signal import Reference

_MOST_EXCLUDED, _MOST_LOST = 0.5, 0.25
"""A frame is lost of which more than the first part is excluded, and the others make a reference if
no more than the second part of them is."""


@dataclass(frozen=True, slots=True, eq=False)
class Rest:
    """The untouched skin, as it was collected.

    Attributes
    ----------
    reference
        Mean and noise of its voltages.
    without_reference
        (n_meas,) bool: measurements that have none.
    interval
        Between its frames, s; NaN where there was a single one.
    host_time
        Of the last of them, s.
    agreement
        Of the reference with the model.
    """

    reference: Reference
    without_reference: NDArray[np.bool_]
    interval: float
    host_time: float = 0.0
    agreement: ModelAgreement = NO_AGREEMENT


class Collecting:
    """Takes frames until there are enough for a reference with its noise.

    A measurement that was excluded in any of them, or that read exactly zero in all, has no
    reference: it takes the model's value, so that nothing downstream meets a NaN or divides by
    zero. A few frames of which most is excluded do not count at all.

    Parameters
    ----------
    needed
        Frames that make a reference.
    model
        (n_meas,) V, what the model expects of the untouched skin.
    least
        V below which no measurement's noise is: a converter that does not flicker rounds all the
        same.
    """

    def __init__(self, needed: int, model: FloatArray, least: FloatArray | float = 0.0) -> None:
        self._values = np.empty((needed, len(model)))
        self._times = np.empty(needed)
        self._model, self._least = model, least
        self._excluded = np.zeros(self._values.shape, dtype=bool)
        self.taken = 0

    @property
    def needed(self) -> int:
        """Frames that make a reference."""
        return len(self._values)

    def push(self, measured: Voltages) -> Rest | None:
        """Take one frame; the untouched skin once there are enough."""
        self._values[self.taken] = np.where(measured.excluded, self._model, measured.values)
        self._times[self.taken] = measured.time
        self._excluded[self.taken] = measured.excluded
        self.taken += 1
        if self.taken < self.needed:
            return None
        lost = self._excluded.mean(axis=1) > _MOST_EXCLUDED
        counts = ~lost if lost.mean() <= _MOST_LOST else np.ones_like(lost)
        values = self._values[counts]
        excluded = self._excluded[counts].any(axis=0) | ~values.any(axis=0)
        values[:, excluded] = self._model[excluded]
        reference = Reference.of(values, self._least)
        interval = float(np.median(np.diff(self._times))) if self.needed > 1 else np.nan
        agreement = ModelAgreement.of(reference.mean[~excluded], self._model[~excluded])
        return Rest(reference, excluded, interval, measured.host_time, agreement)
