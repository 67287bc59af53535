"""Labels that the other presses contradict."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tomoskin.calibration.locator.doubt import squared_lengths
from tomoskin.calibration.locator.kernel import squared_distances
from tomoskin.core import FloatArray

_SAME = 1e-6
"""Squared distance of features, in parts of the usual, at which two presses are one."""

_APART = 0.05
_FAR, _UNLIKELY = 0.3, 23.0
"""An outlier is so far off, in radii of the region, and its squared Mahalanobis length so large
(one in 100,000 of a Gaussian's)."""


@dataclass(frozen=True)
class Remark:
    """Press ``row``, counted from 0, and what is wrong with its label."""

    row: int
    reason: str


def twins(features: FloatArray, places: FloatArray, unit: float) -> list[Remark]:
    """Presses with the same data as an earlier one, at another place."""
    between = squared_distances(features, features)
    usual = float(np.median(between)) or 1.0
    apart = squared_distances(places, places)
    pairs = np.argwhere(np.triu((between < _SAME * usual) & (apart > _APART**2), 1))
    seen: dict[int, Remark] = {}
    for first, second in pairs.tolist():
        far = 1e3 * unit * float(np.sqrt(apart[first, second]))
        seen.setdefault(
            second, Remark(second, f"has the same data as press {first}, {far:.0f} mm away")
        )
    return list(seen.values())


def outliers(
    told: FloatArray, places: FloatArray, covariance: FloatArray, unit: float
) -> list[Remark]:
    """Presses that lie far from where the others say they are: ``told`` (n, 2) left out."""
    error = told - places
    length = np.linalg.norm(error, axis=1)
    rows = np.flatnonzero((squared_lengths(error, covariance) > _UNLIKELY) & (length > _FAR))
    return [
        Remark(row, f"the others say that it was {1e3 * unit * length[row]:.0f} mm away")
        for row in rows.tolist()
    ]
