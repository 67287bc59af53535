"""Image and difference data → detections: regions of the picture, touches fitted to the data, or
places that labelled presses tell."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from tomoskin.calibration import Locator
from tomoskin.core import Detection, FloatArray, Image
from tomoskin.pipeline.prepare import Prepared
from tomoskin.signal import Reference
from tomoskin.source import Configuration, ScanSettings
from tomoskin.touch import EXHAUSTIVE, ImageNoise, Pace, SpotFinder, SpotModel, measured_covariance

_ALL = 0.999
"""Part of a row that is taken for all of it."""


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
    whole
        (n_meas,) V by which the frame differs, with all that is in it; None where that is ``dv``.
    """

    image: Image
    floor: ImageNoise | None
    dv: FloatArray
    blind: FloatArray
    whole: FloatArray | None = None


class Finder(Protocol):
    """What finds the touches of one frame after the other."""

    def renew(self, prepared: Prepared, reference: Reference | None) -> None:
        """Go on with another operator or noise."""
        ...

    def push(self, view: View) -> list[Detection]:
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

    def push(self, view: View) -> list[Detection]:
        """See :class:`Finder`."""
        return self._segmenter(view.image, view.floor)


class InData:
    """Touches are fitted to the data themselves; a filter over frames does not enter."""

    def __init__(
        self,
        model: SpotModel,
        prepared: Prepared,
        reference: Reference | None,
        pace: Pace = EXHAUSTIVE,
    ) -> None:
        gain = _gain(model, prepared, reference)
        noise = _noise(prepared, reference, gain)
        self.model = model
        """The sheet on which touches are fitted, as the reference tells of it."""
        skin, settings = prepared.skin, ScanSettings.of(prepared.skin)
        scan_time = Configuration.of(prepared.scan, settings).scan_time
        self._spots = SpotFinder(
            model, skin, prepared.mesh, noise, gain, scan_time=scan_time, pace=pace
        )

    def renew(self, prepared: Prepared, reference: Reference | None) -> None:
        """See :class:`Finder`."""
        gain = _gain(self.model, prepared, reference)
        self._spots.renew(_noise(prepared, reference, gain), gain)

    def push(self, view: View) -> list[Detection]:
        """See :class:`Finder`."""
        return self._spots.push(view.dv, view.blind)


class ByCalibration:
    """The picture tells that there is a touch, labelled presses where: of one touch at a time."""

    def __init__(self, locator: Locator, prepared: Prepared, reference: Reference | None) -> None:
        self._locator = locator
        self.renew(prepared, reference)

    def renew(self, prepared: Prepared, reference: Reference | None) -> None:
        """See :class:`Finder`."""
        self._image = InImage(prepared)
        self._difference = prepared.operator.difference
        self._mean = prepared.operator.reference if reference is None else reference.mean

    def push(self, view: View) -> list[Detection]:
        """See :class:`Finder`."""
        found = self._image.push(view)
        if not found:
            return []
        # Presses were learnt from with all that is in them: what pictures do without is not left
        # out here either.
        dv = view.dv if self._difference == "plain" else view.dv * np.abs(self._mean)
        dv = np.where(_lost(view.blind), np.nan, dv if view.whole is None else view.whole)
        if not np.isfinite(dv).any():
            return []
        (place,), (spread,) = self._locator.predict(dv)
        sd_x, sd_y = np.sqrt(np.diag(spread)).tolist()
        return [
            replace(
                found[0],
                x=float(place[0]),
                y=float(place[1]),
                sd_x=sd_x,
                sd_y=sd_y,
                cov_xy=float(spread[0, 1]),
            )
        ]


def finding(prepared: Prepared, reference: Reference | None, pace: Pace = EXHAUSTIVE) -> Finder:
    """What finds the touches: a calibration, else the method that the skin names.

    Fitted touches are those of a sheet that conducts by direction as its reference tells.
    ``pace`` says how much of a fit is tried in a frame.
    """
    if prepared.locator is not None:
        return ByCalibration(prepared.locator, prepared, reference)
    if prepared.spots is None or prepared.skin.touch.method != "fit":
        return InImage(prepared)
    spots = prepared.spots if reference is None else prepared.spots.fitted_to(reference.mean)
    return InData(spots, prepared, reference, pace)


def rows_of(missing: NDArray[np.bool_]) -> FloatArray:
    """(n_meas, k) blind directions of rows that are ``missing`` (n_meas,) bool."""
    return np.eye(len(missing))[:, missing]


def _lost(blind: FloatArray) -> NDArray[np.bool_]:
    """(n_meas,) rows of which the blind directions (n_meas, k), orthonormal, leave nothing."""
    return np.asarray((blind**2).sum(axis=1) > _ALL)


def voltage_covariance(
    prepared: Prepared, reference: Reference | None, gain: float = 1.0
) -> FloatArray:
    """(n_meas, n_meas) V² of one frame less the reference; ``gain`` of what is predicted."""
    readout, scan = prepared.readout, prepared.scan
    sd, frames = np.full(prepared.pattern.n_meas, np.nan), 1
    if reference is not None:
        sd, frames = reference.noise, reference.n_frames
    oversampling = prepared.skin.readout.oversampling
    return measured_covariance(
        scan,
        sd,
        frames,
        predicted=abs(gain) * readout.noise,
        step=abs(gain) * readout.volts_per_count * oversampling,
        oversampling=oversampling,
    )


def _noise(prepared: Prepared, reference: Reference | None, gain: float) -> FloatArray:
    """(n_meas, n_meas) covariance of difference data: one frame less the reference."""
    volts = voltage_covariance(prepared, reference, gain)
    if prepared.operator.difference == "plain":
        return volts
    size = np.abs(prepared.operator.reference if reference is None else reference.mean)
    return np.asarray(volts / size[:, None] / size)


def _gain(model: SpotModel, prepared: Prepared, reference: Reference | None) -> float:
    """Ratio of measured and modelled voltages, which a change has too; 1 for ratios."""
    if reference is None or prepared.operator.difference == "normalised":
        return 1.0
    return told_gain(model, reference)


def told_gain(model: SpotModel, reference: Reference) -> float:
    """Ratio of measured and modelled voltages."""
    told = model.response.reference
    return float(reference.mean @ told / (told @ told))
