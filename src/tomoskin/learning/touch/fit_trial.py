"""A calibration beside a fit: what both say together, and whether presses that were left out are
told better by both than by the fit alone."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Self

import numpy as np

from tomoskin.core import FloatArray
from tomoskin.learning.kind import Conditions
from tomoskin.learning.touch.calibration_health import FitCorrection
from tomoskin.learning.touch.locator import Locator

_TRIED = 60
"""Presses that a fit is tried on: each takes a millisecond."""

_SURELY = 2.0
"""Standard errors by which presses must be missed by less than by the fit alone: what is better by
chance among the presses that were learnt from is often worse in the next session."""

_FEWEST = 6
"""Presses that were fitted, from which it is said that the calibration does not help."""


@dataclass(frozen=True, eq=False)
class FitTrial:
    """What presses say of the fit, and of the calibration beside it.

    Attributes
    ----------
    correction
        Of the fit, by the presses.
    alone, together
        Mean m by which presses are missed by the fit alone, and by both, each press left out of
        the calibration; NaN where too few were fitted, or where labels are not known but estimated.
    helps
        Whether the calibration is worth using beside the fit; so where that is not known.
    """

    correction: FitCorrection
    alone: float = np.nan
    together: float = np.nan
    helps: bool = True

    @classmethod
    def of(cls, locator: Locator, conditions: Conditions) -> Self | None:
        """By some of the presses; None where none is fitted."""
        presses = locator.presses
        some = np.unique(np.linspace(0, len(presses) - 1, _TRIED).round().astype(int))
        fitted = conditions.fitted_presses(presses.dv[some])
        if fitted is None:
            return None
        positions, variances = np.full((len(some), 2), np.nan), np.full(len(some), np.nan)
        for k, detection in enumerate(fitted):
            if detection is not None:
                positions[k] = detection.x, detection.y
                variances[k] = (detection.sd_x**2 + detection.sd_y**2) / 2
        labels = presses.xy[some]
        correction = FitCorrection.of(positions, variances, labels)
        fitted_numbers = [k for k, detection in enumerate(fitted) if detection is not None]
        if len(fitted_numbers) < max(_FEWEST, len(some) // 2) or presses.spread is not None:
            return cls(correction)
        left_out = locator.region.metres(locator.stacking.left_out[some])
        spread = locator.calibrated(locator.estimates.left_out_spread[some])
        answers = zip(left_out, locator.region.unit**2 * spread, fitted, strict=True)
        both = [
            together(correction(detection), (place, covariance), doubtful=False)[0]
            for place, covariance, detection in answers
            if detection is not None
        ]
        alone, joint = (
            np.linalg.norm(np.asarray(said) - labels[fitted_numbers], axis=1)
            for said in (positions[fitted_numbers], both)
        )
        less = alone - joint
        helps = bool(less.mean() > _SURELY * less.std() / np.sqrt(len(less)))
        return cls(correction, float(alone.mean()), float(joint.mean()), helps)

    @property
    def text(self) -> str:
        """What was found, in a sentence; "" where that is not known."""
        if np.isnan(self.alone):
            return ""
        both, fit = 1e3 * self.together, 1e3 * self.alone
        if self.helps:
            return (
                f"presses left out are missed by {both:.1f} mm with the calibration, and by "
                f"{fit:.1f} mm by the fit alone"
            )
        return f"the calibration is not used: {both:.1f} mm off, the fit alone {fit:.1f} mm"


def together(
    fitted: tuple[FloatArray, FloatArray], learnt: tuple[FloatArray, FloatArray], *, doubtful: bool
) -> tuple[FloatArray, FloatArray]:
    """What a fit and the presses, each a position (2,) m and a covariance (2, 2) m², say together.

    What they differ by beyond their covariances widens them (the moment estimator of DerSimonian
    and Laird 1986). It is the fit's error: the presses were tried on labels. Of ``doubtful`` ones
    it is both's: of several touches they see what the fit has left of the others, and after a rub
    their labels were found by the skin's model.
    """
    (here, own), (there, covariance) = fitted, learnt
    away = here - there
    beyond = max(float(away @ away - np.trace(own + covariance)) / 2, 0.0) * np.eye(2)
    wider = covariance + beyond if doubtful else covariance
    gain = wider @ np.linalg.inv(wider + own + beyond)
    return there + gain @ away, wider - gain @ wider
