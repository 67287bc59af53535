"""The parts of a skin that other rooms take as their settings; SI units."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class ReadoutSettings:
    """Amplifier and converter: counts = (gain · potential + offset)/reference · 2^bits."""

    adc_bits: int
    reference_voltage: float
    gain: float
    offset: float
    oversampling: int
    settling: float
    tick_rate: float


@dataclass(frozen=True, slots=True)
class InverseSettings:
    """The kind of difference, the method, and what that takes.

    Method "one-step": the prior by name and what it takes; ``alpha`` is a number or "auto":
    chosen by the noise; ``correlation_length`` is in m, None a tenth of the sheet's extent;
    ``time_constant`` in s, 0 is no filter over frames. Method "greit": the ``noise_figure``.
    """

    difference: str
    method: str = "one-step"
    prior: str = "noser"
    alpha: float | str = "auto"
    exponent: float = 0.5
    correlation_length: float | None = None
    time_constant: float = 0.0
    noise_figure: float = 1.0


@dataclass(frozen=True, slots=True)
class SignalSettings:
    """What becomes of the reference: ``baseline`` "follow" or "hold", ``common_modes``
    "projected" or "kept"."""

    baseline: str = "follow"
    common_modes: str = "projected"


@dataclass(frozen=True, slots=True)
class TwinChoice:
    """Name of the twin's settings for this skin."""

    preset: str


@dataclass(frozen=True, slots=True)
class TouchSettings:
    """The method, "image" or "fit"; what counts as a touch; of "image", the thresholds and filters
    that turn a picture into touches, ``smoothing`` in m."""

    gamma1: float
    gamma2: float
    smoothing: float
    sign: str
    snr: float
    position: str
    max_touches: int
    method: str = "image"
