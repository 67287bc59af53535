"""Residual responses of touches: noise along what each did to the rows where it has been.

Textiles and gels do not come back at once, and some not before the next press (play, Prandtl 1928).
A residual response is no touch, and must not move the position of one.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from tomoskin.core import FloatArray
from tomoskin.touch.fit.spot import CONTENT, N_PARAMETERS, Response

_STEP = 0.012
"""A touch that slides leaves a footprint every so many metres."""

_LEFT = 0.05
"""Deviation of the residual response of a touch, in parts of it: a quarter stands out by five."""

_STRONGER = 1.25
"""A footprint is replaced where a touch is by so much stronger than when it was made."""

_MOST = 16
"""Footprints that are kept, the newest."""


@dataclass(frozen=True, eq=False)
class ResidualResponse:
    """Where touches have been since there was none for some time.

    Attributes
    ----------
    spots
        (k, 4), the newest last.
    changes
        (k, n_meas) V, what each did to the rows.
    quiet
        Frames since there was a touch.
    """

    spots: FloatArray
    changes: FloatArray
    quiet: int = 0

    @classmethod
    def none(cls, n_meas: int) -> Self:
        """Where nothing has touched."""
        return cls(np.zeros((0, N_PARAMETERS)), np.zeros((0, n_meas)))

    @property
    def directions(self) -> FloatArray:
        """(n_meas, k) V, each as long as its deviation."""
        return _LEFT * self.changes.T

    def after(self, spots: FloatArray, response: Response, frames: int) -> Self:
        """With a frame in which touches ``spots`` (k, 4) were; forgotten ``frames`` after the
        last of them."""
        if not len(spots):
            if len(self.spots) and self.quiet >= frames:
                return self.none(self.changes.shape[1])
            return replace(self, quiet=self.quiet + 1)
        near = np.linalg.norm(self.spots[:, None, :2] - spots[:, :2], axis=2) < _STEP
        held = near & (_STRONGER * _size(self.spots)[:, None] >= _size(spots))
        fresh = spots[~held.any(axis=0)]
        if not len(fresh):
            return self if not self.quiet else replace(self, quiet=0)
        kept = ~near[:, ~held.any(axis=0)].any(axis=1)
        changes = response.changes([spot[None] for spot in fresh])
        return type(self)(
            np.concatenate([self.spots[kept], fresh])[-_MOST:],
            np.concatenate([self.changes[kept], changes])[-_MOST:],
        )


def _size(spots: FloatArray) -> FloatArray:
    return np.abs(spots[:, CONTENT])
