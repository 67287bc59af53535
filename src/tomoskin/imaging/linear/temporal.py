"""Imaging over frames: a Kalman filter whose state is the image.

The image is taken for a process of first order: its covariance at any time is the prior's, and
what two frames have in common decays with a time constant τ,

    x(t + Δ) = φ x(t) + w,   φ = exp(−Δ/τ),   cov w = (1 − φ²) Q⁻¹.

In the modes of the one-step operator (:class:`Modes`) every covariance stays diagonal, and the
filter (Kalman 1960; for this use Vauhkonen et al. 1998) is exact at the price of one product
with a small matrix more than the operator: no covariance of cells is ever formed. With τ → 0
nothing is remembered, and the image is that of the operator.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from tomoskin.core import DataError, FloatArray, Image, ModelError, check_positive
from tomoskin.imaging.linear.operator import Operator
from tomoskin.imaging.linear.spectrum import Spectrum

_NOTHING = 1e-12
"""A mode whose image is this far below the strongest one is none: half of them when every row
has a reciprocal."""


@dataclass(frozen=True, eq=False)
class Modes:
    """Modes of a one-step operator B: neither noise nor prior couples two of them.

    A mode of the spectrum with eigenvalue λ is trusted by e = λ/(λ + α²), where λ is its prior
    variance in units of its noise, up to α².

    Attributes
    ----------
    operator
        B.
    analysis
        (k, n_meas) difference data → modes.
    synthesis
        (n_cells, k) modes → image, what B makes of each.
    trust
        (k,) e, from 0 (only noise) to 1 (no noise).
    """

    operator: Operator
    analysis: NDArray[Any]
    synthesis: NDArray[Any]
    trust: FloatArray

    @classmethod
    def of(cls, spectrum: Spectrum, alpha: float, operator: Operator | None = None) -> Self:
        """Those of ``spectrum.operator(alpha)``, which ``operator`` is where it is at hand."""
        synthesis = spectrum.modes * spectrum.gains(alpha)
        size = np.linalg.norm(synthesis, axis=0)
        kept = size > _NOTHING * size.max()
        return cls(
            spectrum.operator(alpha) if operator is None else operator,
            np.ascontiguousarray(spectrum.analysis[kept]),
            np.ascontiguousarray(synthesis[:, kept]),
            np.clip(spectrum.filters(alpha)[kept], 0.0, 1.0),
        )

    @cached_property
    def quick_synthesis(self) -> NDArray[Any]:
        """``synthesis`` in single precision: half the bytes per frame."""
        kind = np.complex64 if np.iscomplexobj(self.synthesis) else np.float32
        return self.synthesis.astype(kind)


@dataclass(frozen=True, eq=False)
class Belief:
    """The state of the filter after a frame.

    ``time`` s; ``mean`` (k,) the modes as the operator would have had to measure them;
    ``variance`` (k,) as a part of the prior's.
    """

    time: float
    mean: NDArray[Any]
    variance: FloatArray


class Temporal:
    """Kalman filter over frames of difference data.

    Parameters
    ----------
    modes
        Of the operator whose prior, weights and alpha state what an image is and how large the
        noise is.
    time_constant
        τ, s: how long an image lasts. 0 gives the operator's own images.

    Raises
    ------
    ModelError
        When the time constant is below 0 or not finite.
    """

    def __init__(self, modes: Modes, time_constant: float) -> None:
        self.modes = modes
        if not (np.isfinite(time_constant) and time_constant >= 0):
            raise ModelError(f"expected a time constant of 0 s or more, got {time_constant}")
        self.time_constant = time_constant
        self.belief: Belief | None = None

    def push(self, dv: NDArray[Any], time: float) -> Image:
        """Image at ``time`` s, with ``dv`` (n_meas,) measured then; intervals may vary.

        Raises
        ------
        DataError
            When the time does not increase, or the data do not fit; the filter then stays as
            it was.
        """
        self.belief = self._advanced(dv, time)
        values = self.modes.quick_synthesis @ self.belief.mean.astype(
            self.modes.quick_synthesis.dtype
        )
        operator = self.modes.operator
        values = values.astype(np.result_type(values, np.float64))
        return Image(values, operator.unit, operator.model.mesh.identity)

    def _advanced(self, dv: NDArray[Any], time: float) -> Belief:
        """The scalar Kalman update of every mode, written in e so that e = 0 and e = 1 hold too."""
        last, trust = self.belief, self.modes.trust
        data = self.modes.analysis @ self.modes.operator.check(dv)
        if not np.isfinite(time):
            raise DataError(f"expected a finite time, got {time}")
        if last is None:
            before, expected = np.zeros_like(data), np.ones(len(data))
        elif time > last.time:
            kept = _kept(time - last.time, self.time_constant)
            before, expected = kept * last.mean, kept**2 * last.variance + (1.0 - kept**2)
        else:
            raise DataError(
                f"expected frames in order of time, got {time:g} s after {last.time:g} s",
                hint="leave out repeated frames, or reset the filter",
            )
        gain = _gain(expected, trust)
        return Belief(time, before + gain * (data - trust * before), gain * (1.0 - trust))

    def reset(self) -> None:
        """Forget every frame, for instance with a new reference."""
        self.belief = None

    def steady(self, interval: float) -> tuple[FloatArray, FloatArray]:
        """Gains and poles (k,) for frames every ``interval`` s, long after the start.

        Then each mode ← pole · mode + gain · data. Raises DataError.
        """
        check_positive(interval, "an interval", DataError, " s")
        kept = _kept(interval, self.time_constant)
        trust = self.modes.trust
        gain = _gain(_steady_variance(trust, 1.0 - kept**2), trust)
        return gain, kept * (1.0 - trust * gain)

    def spread(self, noise: FloatArray, interval: float) -> FloatArray:
        """(n_cells, k) S with S·Sᵀ the covariance of the image, frames every ``interval`` s.

        ``noise`` (n_meas,) is the deviation of each row of difference data, independent from
        row to row and from frame to frame, or (n_meas, m) a root of their covariance; what the
        modes have in common is Σ over the past of
        gᵢpᵢⁿ cᵢⱼ gⱼpⱼⁿ, with gain g, pole p and their covariance c in one frame.
        """
        gain, pole = self.steady(interval)
        root = np.diag(noise) if noise.ndim == 1 else noise
        analysis = self.modes.analysis @ root
        shared = (analysis @ analysis.conj().T) / (1.0 - np.outer(pole, pole))
        values, vectors = np.linalg.eigh(shared * np.outer(gain, gain))
        return np.asarray(self.modes.synthesis @ (vectors * np.sqrt(np.maximum(values, 0.0))))


def _gain(expected: FloatArray, trust: FloatArray) -> FloatArray:
    spread = expected * trust + (1.0 - trust)
    return np.divide(expected, spread, out=np.zeros_like(expected), where=spread > 0)


def _kept(interval: float, time_constant: float) -> float:
    return float(np.exp(-interval / time_constant)) if time_constant > 0 else 0.0


def _steady_variance(trust: FloatArray, lost: float) -> FloatArray:
    """The variance before a frame that comes back after it: e r² + s(1 − 2e) r = s(1 − e)."""
    b = lost * (1.0 - 2.0 * trust)
    root = np.sqrt(b**2 + 4.0 * trust * lost * (1.0 - trust))
    with np.errstate(divide="ignore", invalid="ignore"):  # each form where it is stable
        return np.where(b >= 0, 2.0 * lost * (1.0 - trust) / (b + root), (root - b) / (2.0 * trust))
