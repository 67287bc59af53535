"""How strong a touch is: the logarithm of its content, followed over frames."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Self

from tomoskin.core import Detection

# Deviations are those of fits to the moving plant, seeds 1 to 3 (docs/theory/tracking.md).

NOISE = 0.15
"""Of the logarithm of a content from frame to frame."""

ELSEWHERE = 0.10
"""Of the difference that another position makes: the sheet is uneven."""

_WALK = 0.03
"""Variance by which a finger's force changes it in a second."""


@dataclass(frozen=True, slots=True)
class TouchStrength:
    """``mean`` of the logarithm of a touch's content, and its ``variance``."""

    mean: float
    variance: float

    @classmethod
    def of(cls, detection: Detection) -> Self:
        """As one frame tells it."""
        return cls(log_content(detection), NOISE**2)

    def after(self, detection: Detection, seconds: float) -> Self:
        """With one frame more, some ``seconds`` later (Kalman 1960)."""
        before = self.variance + _WALK * seconds
        gain = before / (before + NOISE**2)
        mean = self.mean + gain * (log_content(detection) - self.mean)
        return type(self)(mean, (1 - gain) * before)

    def log_likelihood(self, other: TouchStrength) -> float:
        """Of being that of the same touch as ``other``, elsewhere."""
        variance = self.variance + other.variance + ELSEWHERE**2
        return -0.5 * ((self.mean - other.mean) ** 2 / variance + math.log(variance))

    def plus(self, other: TouchStrength) -> TouchStrength:
        """Of two touches that are seen as one: contents add up."""
        mean = math.log(math.exp(self.mean) + math.exp(other.mean))
        share = 1 / (1 + math.exp(other.mean - self.mean))
        variance = share**2 * self.variance + (1 - share) ** 2 * other.variance
        return TouchStrength(mean, variance)


def content_of(detection: Detection) -> float:
    """Its peak times its area: what it changes, whatever stands beside it."""
    return abs(detection.peak) * detection.area


def log_content(detection: Detection) -> float:
    """Logarithm of the size of the peak times the area; 0 where it has none."""
    content = content_of(detection)
    return math.log(content) if content > 0 else 0.0
