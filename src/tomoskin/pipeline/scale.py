"""The fixed colour scale: how much a firm press shows in the picture of this skin."""

from __future__ import annotations

import math

import numpy as np

from tomoskin.pipeline.prepare import Prepared

_RADIUS = 0.015


def colour_limit(prepared: Prepared) -> float:
    """End of the symmetric scale, in the image's unit, rounded up to 1, 2 or 5.

    The largest change that the operator shows for a round touch of 15 mm radius in the middle
    of the sheet that takes away all of its conductivity, by the linear model.
    """
    mesh, skin = prepared.mesh, prepared.skin
    middle = mesh.volumes @ mesh.centroids / mesh.volumes.sum()
    distance = np.linalg.norm(mesh.centroids - middle, axis=1)
    touched = distance <= max(_RADIUS, float(distance.min()))
    change = np.where(touched, -skin.conductivity, 0.0)
    dv = (prepared.problem.jacobian @ change).real
    return _rounded(float(np.abs(prepared.operator(dv).values).max()))


def _rounded(value: float) -> float:
    if not value > 0:
        return 1.0
    decade = 10.0 ** math.floor(math.log10(value))
    return next(step * decade for step in (1, 2, 5, 10) if value <= step * decade * (1 + 1e-9))
