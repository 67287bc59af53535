"""A one-step operator as independent modes, so that a filter over frames is a set of scalars."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tomoskin.core import FloatArray
from tomoskin.inverse.one_step import OneStep

_NOTHING = 1e-12
"""A mode whose picture is this far below the strongest one is none: half of them when every row
has a reciprocal."""


@dataclass(frozen=True, eq=False)
class Modes:
    """Modes of the operator B of (JᵀWJ + α²Q)⁻¹JᵀW.

    The matrix √W J B √W⁻¹ is Hermitian with eigenvalues e = λ/(λ + α²), where λ is the prior
    variance of a mode in units of its noise, up to α². In the basis U of its vectors neither
    noise nor prior couple two modes.

    Attributes
    ----------
    operator
        As given.
    analysis
        (k, n_meas) Uᴴ√W: difference data → modes.
    picture
        (n_cells, k) B √W⁻¹U: modes → image.
    trust
        (k,) e, from 0 (only noise) to 1 (no noise).
    """

    operator: OneStep
    analysis: NDArray[Any]
    picture: NDArray[Any]
    trust: FloatArray

    @classmethod
    def of(cls, operator: OneStep) -> Modes:
        """Take ``operator`` apart; once, at the cost of an eigenvalue problem of n_meas rows."""
        root = np.sqrt(operator.problem.weights)
        seen = root[:, None] * (operator.problem.jacobian @ operator.matrix) / root
        trust, basis = np.linalg.eigh((seen + seen.conj().T) / 2.0)
        picture = (operator.matrix / root) @ basis
        size = np.linalg.norm(picture, axis=0)
        kept = size > _NOTHING * size.max()
        return cls(
            operator,
            np.ascontiguousarray((root[:, None] * basis[:, kept]).conj().T),
            np.ascontiguousarray(picture[:, kept]),
            np.clip(trust[kept], 0.0, 1.0),
        )

    @cached_property
    def quick_picture(self) -> NDArray[Any]:
        """``picture`` in single precision: half the bytes per frame."""
        kind = np.complex64 if np.iscomplexobj(self.picture) else np.float32
        return self.picture.astype(kind)
