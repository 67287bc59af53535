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

from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tomoskin.core import DataError, FloatArray, Image, ModelError
from tomoskin.imaging.linear.modes import Modes
from tomoskin.imaging.linear.one_step import OneStep


@dataclass(frozen=True, eq=False)
class Belief:
    """The state of the filter after a frame.

    ``time`` s; ``mean`` (k,) the modes as the operator would have had to measure them;
    ``variance`` (k,) as a part of the prior's, and ``expected`` (k,) the same before the frame;
    ``kept`` φ since the frame before.
    """

    time: float
    mean: NDArray[Any]
    variance: FloatArray
    expected: FloatArray
    kept: float


@dataclass(frozen=True, eq=False)
class Steady:
    """The filter for frames at one interval, long after its start: one pole per mode.

    Attributes
    ----------
    gain, pole
        (k,) mode ← pole · mode + gain · data.
    noise
        (k,) variance of each mode under white measurement noise, as a part of the operator's.
    """

    gain: FloatArray
    pole: FloatArray
    noise: FloatArray


class Temporal:
    """Kalman filter over frames of difference data.

    Parameters
    ----------
    operator
        Whose prior, weights and alpha state what an image is and how large the noise is; or its
        modes, for several filters.
    time_constant
        τ, s: how long an image lasts. 0 gives the operator's own images.

    Raises
    ------
    ModelError
        When the time constant is below 0 or not finite.
    """

    def __init__(self, operator: OneStep | Modes, time_constant: float) -> None:
        self.modes = Modes.taken_from(operator)
        self.time_constant = checked_time_constant(time_constant)
        self.belief: Belief | None = None

    def push(self, dv: NDArray[Any], time: float) -> Image:
        """Image at ``time`` s, with ``dv`` (n_meas,) measured then; intervals may vary.

        Raises
        ------
        DataError
            When the time does not increase, or the data do not fit; the filter then stays as
            it was.
        """
        self.belief = advance(self.modes, self.time_constant, self.belief, dv, time)
        return image_of(self.modes, self.belief.mean)

    def reset(self) -> None:
        """Forget every frame, for instance with a new reference."""
        self.belief = None

    def steady(self, interval: float) -> Steady:
        """Gains, poles and noise for frames every ``interval`` s. Raises DataError."""
        if not (np.isfinite(interval) and interval > 0):
            raise DataError(f"expected an interval above 0 s, got {interval}")
        kept = _kept(interval, self.time_constant)
        trust = self.modes.trust
        gain = _gain(_steady_variance(trust, 1.0 - kept**2), trust)
        pole = kept * (1.0 - trust * gain)
        return Steady(gain, pole, gain**2 / (1.0 - pole**2))

    def noise_left(self, interval: float) -> FloatArray:
        """(n_cells,) deviation of each cell under white noise, as a part of the operator's."""
        power = np.abs(self.modes.synthesis) ** 2
        return np.asarray(np.sqrt(power @ self.steady(interval).noise / power.sum(axis=1)))

    def spread(self, noise: FloatArray, interval: float) -> FloatArray:
        """(n_cells, k) S with S·Sᵀ the covariance of the image, frames every ``interval`` s.

        ``noise`` (n_meas,) is the deviation of each row of difference data, independent from
        row to row and from frame to frame, or (n_meas, m) a root of their covariance; what the
        modes have in common is Σ over the past of
        gᵢpᵢⁿ cᵢⱼ gⱼpⱼⁿ, with gain g, pole p and their covariance c in one frame.
        """
        steady = self.steady(interval)
        root = np.diag(noise) if noise.ndim == 1 else noise
        analysis = self.modes.analysis @ root
        shared = (analysis @ analysis.conj().T) / (1.0 - np.outer(steady.pole, steady.pole))
        values, vectors = np.linalg.eigh(shared * np.outer(steady.gain, steady.gain))
        return np.asarray(self.modes.synthesis @ (vectors * np.sqrt(np.maximum(values, 0.0))))


def advance(
    modes: Modes, time_constant: float, last: Belief | None, dv: NDArray[Any], time: float
) -> Belief:
    """One step of the filter; see :meth:`Temporal.push`."""
    data = modes.analysis @ modes.operator.check(dv)
    if not np.isfinite(time):
        raise DataError(f"expected a finite time, got {time}")
    if last is None:
        unknown = np.ones(len(data))
        nothing = Belief(time, np.zeros_like(data), unknown, unknown, 0.0)
        return _updated(nothing, data, modes.trust)
    if time <= last.time:
        raise DataError(
            f"expected frames in order of time, got {time:g} s after {last.time:g} s",
            hint="leave out repeated frames, or reset the filter",
        )
    kept = _kept(time - last.time, time_constant)
    expected = kept**2 * last.variance + (1.0 - kept**2)
    return _updated(Belief(time, kept * last.mean, expected, expected, kept), data, modes.trust)


def image_of(modes: Modes, mean: NDArray[Any]) -> Image:
    """The image of the state's ``mean`` (k,)."""
    values = modes.quick_synthesis @ mean.astype(modes.quick_synthesis.dtype)
    values = values.astype(np.result_type(values, np.float64))
    return Image(values, modes.operator.unit, modes.operator.model.mesh.identity)


def checked_time_constant(value: float) -> float:
    """``value``; raises ModelError unless it is a time, s."""
    if not (np.isfinite(value) and value >= 0):
        raise ModelError(f"expected a time constant of 0 s or more, got {value}")
    return value


def _updated(before: Belief, data: NDArray[Any], trust: FloatArray) -> Belief:
    """The scalar Kalman update of every mode, written in e so that e = 0 and e = 1 hold too."""
    gain = _gain(before.expected, trust)
    mean = before.mean + gain * (data - trust * before.mean)
    return replace(before, mean=mean, variance=gain * (1.0 - trust))


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


@dataclass(frozen=True, eq=False)
class Smoothed:
    """An image of ``time`` s; ``variance`` (k,) of its modes, as a part of the prior's."""

    time: float
    image: Image
    variance: FloatArray


class Smoother:
    """The filter of :class:`Temporal`, followed by a pass back over the last ``lag`` frames.

    The pass is that of Rauch, Tung & Striebel (1965), mode by mode.

    Raises
    ------
    ModelError
        When the lag is not a whole number of frames from 0, or the time constant no time.
    """

    def __init__(self, operator: OneStep | Modes, time_constant: float, lag: int) -> None:
        if not (isinstance(lag, int) and lag >= 0):
            raise ModelError(f"expected a lag of 0 frames or more, got {lag}")
        self.modes = Modes.taken_from(operator)
        self.time_constant = checked_time_constant(time_constant)
        self.lag = lag
        self._beliefs: deque[Belief] = deque(maxlen=lag + 1)

    def push(self, dv: NDArray[Any], time: float) -> Smoothed | None:
        """Image of the frame ``lag`` frames ago; None until there were so many.

        Raises DataError as :meth:`Temporal.push`.
        """
        last = self._beliefs[-1] if self._beliefs else None
        self._beliefs.append(advance(self.modes, self.time_constant, last, dv, time))
        if len(self._beliefs) <= self.lag:
            return None
        *_, oldest = self._backwards()
        return self._shown(oldest)

    def finish(self) -> tuple[Smoothed, ...]:
        """Images of the frames that are still waiting, oldest first; then it starts afresh."""
        waiting = list(self._backwards())[::-1]
        if len(self._beliefs) > self.lag:
            del waiting[0]
        self._beliefs.clear()
        return tuple(self._shown(belief) for belief in waiting)

    def _shown(self, belief: Belief) -> Smoothed:
        return Smoothed(belief.time, image_of(self.modes, belief.mean), belief.variance)

    def _backwards(self) -> Iterator[Belief]:
        """Every frame in the window given all of them, newest first."""
        smoothed: Belief | None = None
        later: Belief | None = None
        for belief in reversed(self._beliefs):
            smoothed = (
                belief if smoothed is None or later is None else _given(belief, later, smoothed)
            )
            later = belief
            yield smoothed


def _given(belief: Belief, later: Belief, smoothed: Belief) -> Belief:
    """``belief``, given ``smoothed``: that of the frame after it in the light of all later ones.

    ``later`` is that belief as the filter had it.
    """
    share = np.divide(
        later.kept * belief.variance,
        later.expected,
        out=np.zeros_like(later.expected),
        where=later.expected > 0,
    )
    return replace(
        belief,
        mean=belief.mean + share * (smoothed.mean - later.kept * belief.mean),
        variance=belief.variance + share**2 * (smoothed.variance - later.expected),
    )
