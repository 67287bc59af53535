"""A one-step operator as independent modes, so that a filter over frames is a set of scalars."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tomoskin.core import FloatArray, ModelError
from tomoskin.imaging.linear.one_step import OneStep
from tomoskin.imaging.linear.operator import Operator
from tomoskin.imaging.linear.problem import LinearProblem
from tomoskin.imaging.linear.spectrum import Spectrum

_NOTHING = 1e-12
"""A mode whose image is this far below the strongest one is none: half of them when every row
has a reciprocal."""

_SKEW = 1e-6
"""What an operator of the problem may deviate from symmetry by rounding."""


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
    synthesis
        (n_cells, k) B √W⁻¹U: modes → image.
    trust
        (k,) e, from 0 (only noise) to 1 (no noise).
    """

    operator: Operator
    analysis: NDArray[Any]
    synthesis: NDArray[Any]
    trust: FloatArray

    @classmethod
    def of(cls, problem: LinearProblem, operator: Operator) -> Modes:
        """Take an ``operator`` of ``problem`` apart: one eigenvalue problem of n_meas rows.

        Raises
        ------
        ModelError
            When the operator was not made from the problem as it is: trained, of another mesh
            or pattern, or without some rows.
        """
        root = np.sqrt(problem.weights)
        if operator.matrix.shape != problem.jacobian.shape[::-1]:
            raise _foreign()
        resolution = root[:, None] * (problem.jacobian @ operator.matrix) / root
        if np.abs(resolution - resolution.conj().T).max() > _SKEW * np.abs(resolution).max():
            raise _foreign()
        trust, basis = np.linalg.eigh((resolution + resolution.conj().T) / 2.0)
        analysis = (root[:, None] * basis).conj().T
        return cls._without_nothing(operator, analysis, (operator.matrix / root) @ basis, trust)

    @classmethod
    def of_spectrum(cls, spectrum: Spectrum, alpha: float, operator: Operator) -> Modes:
        """The same of ``spectrum.operator(alpha)``, by its modes: no eigenvalue problem."""
        synthesis = spectrum.modes * spectrum.gains(alpha)
        return cls._without_nothing(operator, spectrum.analysis, synthesis, spectrum.filters(alpha))

    @classmethod
    def _without_nothing(
        cls,
        operator: Operator,
        analysis: NDArray[Any],
        synthesis: NDArray[Any],
        trust: FloatArray,
    ) -> Modes:
        size = np.linalg.norm(synthesis, axis=0)
        kept = size > _NOTHING * size.max()
        return cls(
            operator,
            np.ascontiguousarray(analysis[kept]),
            np.ascontiguousarray(synthesis[:, kept]),
            np.clip(trust[kept], 0.0, 1.0),
        )

    @classmethod
    def taken_from(cls, source: OneStep | Modes) -> Modes:
        """The modes of a one-step operator, or those that there are already."""
        return source if isinstance(source, Modes) else cls.of(source.problem, source)

    @cached_property
    def quick_synthesis(self) -> NDArray[Any]:
        """``synthesis`` in single precision: half the bytes per frame."""
        kind = np.complex64 if np.iscomplexobj(self.synthesis) else np.float32
        return self.synthesis.astype(kind)


def _foreign() -> ModelError:
    return ModelError(
        "expected an operator that solves the linear problem with all of its rows, got another one",
        hint="use OneStep, and fill missing rows instead of leaving them out",
    )
