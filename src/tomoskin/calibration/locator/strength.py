"""How hard a press was: learnt from labels, or against the usual press at its place."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Self

import numpy as np

from tomoskin.calibration.locator.kernel import squared_distances
from tomoskin.calibration.locator.presses import Presses
from tomoskin.core import FloatArray

_NEAR = 0.3
"""Radius of what is called the same place, in radii of the region."""

_LEAST = 1e-12


@dataclass(frozen=True, eq=False)
class Strength:
    """A local power law: log strength = a + b (log size − log usual size at the place).

    ``places`` (n, 2); ``sizes`` (n,) log root mean square of each press; ``labels`` (n,) log
    strength, or None; ``exponent`` b.
    """

    places: FloatArray
    sizes: FloatArray
    labels: FloatArray | None
    exponent: float

    @classmethod
    def of(cls, presses: Presses, places: FloatArray) -> Self:
        """Learn from presses whose left-out places are ``places`` (n, 2), in radii."""
        sizes = _size(presses.dv)
        if presses.strength is None:
            return cls(places, sizes, None, 1.0)
        labels = np.log(np.maximum(presses.strength, _LEAST))
        plain = cls(places, sizes, labels, 0.0)
        x = sizes - plain.usual(places, sizes)
        y = labels - plain.usual(places, labels)
        exponent = float(x @ y) / max(float(x @ x), _LEAST)
        return cls(places, sizes, labels, exponent)

    def __call__(self, dv: FloatArray, places: FloatArray) -> FloatArray:
        """(n,) strengths of frames ``dv`` (n, n_meas) whose touch is at ``places`` (n, 2)."""
        beyond = self.exponent * (_size(dv) - self.usual(places, self.sizes))
        middle = 0.0 if self.labels is None else self.usual(places, self.labels)
        return np.asarray(np.exp(middle + beyond))

    def usual(self, places: FloatArray, values: FloatArray) -> FloatArray:
        """(m,) mean of the presses' ``values`` (n,) about ``places`` (m, 2)."""
        near = np.exp(-0.5 * squared_distances(places, self.places) / _NEAR**2) + _LEAST
        return np.asarray(near @ values / near.sum(axis=1))


def _size(dv: FloatArray) -> FloatArray:
    return np.asarray(0.5 * np.log(np.nanmean(dv**2, axis=1) + _LEAST))
