"""What the data cannot tell of a skin: which part of a change its image leaves open, and where."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tomoskin.core import FloatArray, IntArray, ModelError
from tomoskin.imaging import unresolved
from tomoskin.pipeline.prepare import Prepared
from tomoskin.sensing.fit import SpotPrior


@dataclass(frozen=True, eq=False)
class Unresolved:
    """One map for all frames of a skin with the same alpha and the same measurements.

    Attributes
    ----------
    values
        (n_cells,) from 0, all is told, to 1, nothing is; see :func:`tomoskin.imaging.unresolved`.
    radius
        Of the disc about each cell, m: that of a usual touch.
    """

    values: FloatArray
    radius: float

    @classmethod
    def of(cls, prepared: Prepared, alpha: float, excluded: IntArray) -> Unresolved:
        """Of an image by ``alpha`` without the measurements ``excluded``.

        Raises
        ------
        ModelError
            For a trained operator, which stands for no prior.
        DataError
            When too few measurements are left.
        """
        if prepared.skin.inverse.method != "one-step":
            raise ModelError(
                "a trained operator has no prior, so what it leaves open is not known",
                hint='set method = "one-step" in [inverse]',
            )
        operator = prepared.problem.operator(alpha).without(np.asarray(excluded))
        radius = SpotPrior.of(prepared.mesh).radius
        return cls(unresolved(operator, prepared.problem, alpha, radius), radius)
