"""Image and difference data → readings: regions of the picture, or touches fitted to the data."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from tomoskin.core import FloatArray, Image, Reading
from tomoskin.live.prepare import Prepared
from tomoskin.signal import Reference
from tomoskin.touch import NoiseFloor, SpotFinder, SpotModel, measured_covariance


@dataclass(frozen=True, slots=True, eq=False)
class View:
    """What one frame shows.

    Attributes
    ----------
    image, floor
        Its picture, and the noise of that where it is known.
    dv
        (n_meas,) difference data.
    blind
        (n_meas, k) directions along which they say nothing.
    """

    image: Image
    floor: NoiseFloor | None
    dv: FloatArray
    blind: FloatArray


class Finder(Protocol):
    """What finds the touches of one frame after the other."""

    def renew(self, prepared: Prepared, reference: Reference | None) -> None:
        """Go on with another operator or noise."""
        ...

    def push(self, view: View) -> list[Reading]:
        """Readings of a frame, strongest first."""
        ...


class InImage:
    """Touches are regions of the picture."""

    def __init__(self, prepared: Prepared) -> None:
        self._segmenter = prepared.segmenter

    def renew(self, prepared: Prepared, reference: Reference | None) -> None:
        """See :class:`Finder`."""
        del reference
        self._segmenter = prepared.segmenter

    def push(self, view: View) -> list[Reading]:
        """See :class:`Finder`."""
        return self._segmenter(view.image, view.floor)


class InData:
    """Touches are fitted to the data themselves; a filter over frames does not enter."""

    def __init__(self, model: SpotModel, prepared: Prepared, reference: Reference | None) -> None:
        gain = _gain(model, prepared, reference)
        noise = _noise(prepared, reference, gain)
        self._model = model
        self._spots = SpotFinder(model, prepared.skin, prepared.mesh, noise, gain)

    def renew(self, prepared: Prepared, reference: Reference | None) -> None:
        """See :class:`Finder`."""
        gain = _gain(self._model, prepared, reference)
        self._spots.renew(_noise(prepared, reference, gain), gain)

    def push(self, view: View) -> list[Reading]:
        """See :class:`Finder`."""
        return self._spots.push(view.dv, view.blind)


def finding(prepared: Prepared, reference: Reference | None) -> Finder:
    """What finds the touches, by the method that the skin names."""
    if prepared.spots is None:
        return InImage(prepared)
    return InData(prepared.spots, prepared, reference)


def rows_of(missing: NDArray[np.bool_]) -> FloatArray:
    """(n_meas, k) blind directions of rows that are ``missing`` (n_meas,) bool."""
    return np.eye(len(missing))[:, missing]


def _noise(prepared: Prepared, reference: Reference | None, gain: float) -> FloatArray:
    """(n_meas, n_meas) covariance of difference data: one frame less the reference."""
    readout, scan = prepared.readout, prepared.scan
    sd, frames = np.full(prepared.pattern.n_meas, np.nan), 1
    if reference is not None:
        sd, frames = reference.noise, reference.n_frames
    oversampling = prepared.skin.readout.oversampling
    volts = measured_covariance(
        scan,
        sd,
        frames,
        predicted=abs(gain) * readout.noise,
        step=abs(gain) * readout.volts_per_count * oversampling,
        oversampling=oversampling,
    )
    if prepared.operator.difference == "plain":
        return volts
    size = np.abs(prepared.operator.reference if reference is None else reference.mean)
    return np.asarray(volts / size[:, None] / size)


def _gain(model: SpotModel, prepared: Prepared, reference: Reference | None) -> float:
    """Ratio of measured and modelled voltages, which a change has too; 1 for ratios."""
    if reference is None or prepared.operator.difference == "normalised":
        return 1.0
    told = model.response.reference
    return float(reference.mean @ told / (told @ told))
