"""What a calibration does with each frame, and what it is given for that."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from tomoskin.core import Detection, FloatArray, Image
from tomoskin.touch import ImageNoise, Response

BoolArray = NDArray[np.bool_]


@dataclass(frozen=True, slots=True, eq=False)
class FrameView:
    """What one frame shows.

    Attributes
    ----------
    time
        Of the frame, s.
    image, image_noise
        Its image, and the noise of that where it is known.
    dv
        (n_meas,) difference data without their part in the nuisance subspace.
    nuisance
        (n_meas, k) directions of the difference data that carry no information.
    change
        (n_meas,) V by which the frame differs from the baseline, with all that is in it.
    drift
        (n_meas, k) V: directions of drift and of excluded measurements.
    from_rest
        (n_meas,) V by which it differs from the reference as that was taken.
    excluded
        (n_meas,) bool: measurements that do not count.
    """

    time: float
    image: Image
    image_noise: ImageNoise | None
    dv: FloatArray
    nuisance: FloatArray
    change: FloatArray
    drift: FloatArray
    from_rest: FloatArray
    excluded: BoolArray

    @property
    def since_reference(self) -> FloatArray:
        """(n_meas,) V by which it differs from that reference, NaN where excluded."""
        return np.where(self.excluded, np.nan, self.from_rest)


Detect = Callable[[FrameView, list[Detection]], list[Detection]]
"""Touches fitted to the data of a frame, given those that the skin's own method found."""


@dataclass(frozen=True, slots=True, eq=False)
class TouchFit:
    """Touches on the forward model: its ``response``; the ``gain`` of measured against modelled
    voltages; ``detect``, which fits them to a frame."""

    response: Response
    gain: float
    detect: Detect


class Conditions(Protocol):
    """Under which a calibration is applied, from one reference on."""

    def touch_fit(self) -> TouchFit | None:
        """The fit of touches beside the calibration; None where no reference is known."""
        ...


class Applied:
    """What a calibration does with each frame; a kind overrides what it needs.

    ``moved`` V, or (n_meas,) V: what of the newest frame the baseline must not learn.
    """

    moved: FloatArray | float = 0.0

    def locate(self, view: FrameView, detections: list[Detection]) -> list[Detection]:
        """Detections with better positions."""
        del view
        return detections

    def read(self, view: FrameView, detections: list[Detection], *, touched: bool) -> Any | None:
        """What the frame says of the calibration's subject.

        ``touched``: whether a touch stands, by one who has tracked the frames before.
        """
        del view, detections, touched
        return None


_ALL = 0.999
"""Part of a measurement that is taken for all of it."""


def without_information(nuisance: FloatArray) -> BoolArray:
    """(n_meas,) measurements of which the nuisance directions (n_meas, k), orthonormal, leave
    nothing."""
    return np.asarray((nuisance**2).sum(axis=1) > _ALL)
