"""The kind of calibration that tells how the sheet is bent, from recorded bends; and what reads it
frame by frame: how far, and whether idle, bent, touched, both, or unknown."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from tomoskin.core import Detection, FloatArray
from tomoskin.learning.bend.bend_model import BendModel
from tomoskin.learning.kind import Applied, Conditions, FrameView, Kind, TouchFit
from tomoskin.sensing.fit import Response, spots_of

_BENT = 3.0
"""Deviations by which an angle must stand out to be called a bend."""

_LIKE = 2.0
"""Times the noise that may be left unexplained."""

_ROUGH = 0.15
"""Part of what touches and bends change that their models may miss."""


@dataclass(frozen=True, slots=True)
class BendReading:
    """How the sheet is bent in one frame.

    Attributes
    ----------
    angle, sd
        Rad, and its standard deviation.
    axis
        Rad from u, from 0 to π.
    state
        "idle", "bend", "touch", "bend and touch", or "unknown" for a change that neither bends
        nor touches explain.
    moved
        (n_meas,) V that the bend adds to the reference.
    """

    angle: float
    sd: float
    axis: float
    state: str
    moved: FloatArray


class BendReader:
    """Reads one frame after the other; it remembers what the sheet does.

    Parameters
    ----------
    model
        Learnt from recorded bends.
    response
        The forward model with touches on it.
    gain
        Of measured voltages against the model's.
    """

    def __init__(self, model: BendModel, response: Response, gain: float = 1.0) -> None:
        self._model, self._response, self._gain = model, response, gain
        self._modes = model.whiten(model.directions.T).T
        self._memory = model.memory()

    def push(
        self,
        dv: FloatArray,
        detections: Sequence[Detection],
        common: FloatArray,
        time: float,
        *,
        touched: bool = True,
    ) -> BendReading:
        """Read ``dv`` (n_meas,) V less the straight sheet, at ``time`` s.

        ``detections`` are the touches fitted to it; ``common`` (n_meas, k) directions that say
        nothing. Amplitudes are fitted beside what the touches change, their places, sizes,
        strengths and directions free to first order. ``touched`` is False where none of them is a
        touch to one who has seen the frames before.
        """
        model = self._model
        change, free = self._touches(detections)
        data = model.whiten(dv) - change
        nuisance = np.hstack([model.whiten(common.T).T, free])
        columns = np.hstack([self._modes, nuisance / (np.linalg.norm(nuisance, axis=0) + 1e-300)])
        fitted, _, rank, _ = np.linalg.lstsq(columns, data, rcond=1e-9)
        z = fitted[: model.n_modes]
        residual = data - columns @ fitted
        explained = np.linalg.norm(model.whiten(dv)) * _ROUGH
        strange = residual @ residual > (_LIKE**2) * max(len(data) - rank, 1) + explained**2
        target = self._memory.push(z, time) @ model.weights
        angle, axis = (float(part[0]) for part in model.predict(target[None]))
        sd = self._deviation(columns)
        pressed = bool(detections) and touched
        state = _state(abs(angle) > _BENT * sd, pressed, bool(strange))
        return BendReading(angle, sd, axis, state, model.directions @ z)

    def _touches(self, detections: Sequence[Detection]) -> tuple[FloatArray, FloatArray]:
        """(r,) what they change, whitened, and (r, c) its derivatives."""
        whiten = self._model.whiten
        if not detections:
            return np.zeros(len(self._modes)), np.zeros((len(self._modes), 0))
        conductivity = float(np.mean(self._response.state.conductivity))
        spots = np.array([_spot_of(detection, conductivity) for detection in detections])
        change, slopes, towards = self._response.expanded(spots)
        rows = self._gain * np.column_stack([change, slopes, towards]).T
        whitened = whiten(rows)
        return whitened[0], whitened[1:].T

    def _deviation(self, columns: FloatArray) -> float:
        """Rad: what the examples are missed by, and what the noise and the touches leave open."""
        model = self._model
        k = model.n_modes
        spread = np.linalg.pinv(columns)[:k]
        slope = model.weights[:k, 0]
        return float(np.hypot(model.error, np.linalg.norm(slope @ spread)))


def _spot_of(detection: Detection, conductivity: float) -> FloatArray:
    """(4,) parameters of a fitted touch as it was reported."""
    depth = float(np.log1p(detection.peak / conductivity))
    place = np.array([[detection.x, detection.y]])
    return np.asarray(spots_of(place, float(np.sqrt(detection.area / np.pi)), depth)[0])


def _state(bent: bool, touched: bool, strange: bool) -> str:
    if strange:
        return "unknown"
    if bent:
        return "bend and touch" if touched else "bend"
    return "touch" if touched else "idle"


class BendApplied(Applied):
    """Reads how the sheet is bent, beside the touches of each frame.

    An angle is told beside a touch only where what the touch changes is known, so that touches
    are fitted to the data here where the skin finds its own in the image.
    """

    def __init__(self, model: BendModel, fit: TouchFit) -> None:
        self._reader = BendReader(model, fit.response, fit.gain)
        self._detect = fit.detect

    def read(self, view: FrameView, detections: list[Detection], *, touched: bool) -> BendReading:
        """How the sheet is bent in this frame."""
        touches = self._detect(view, detections)
        data = view.differences
        reading = self._reader.push(data.change, touches, data.drift, view.time, touched=touched)
        self.moved = reading.moved
        return reading


def _apply(model: BendModel, conditions: Conditions) -> Applied:
    fit = conditions.touch_fit()
    return Applied() if fit is None else BendApplied(model, fit)


BENDS = Kind(
    name="bend",
    title="tomoskin bend calibration",
    subject="bends",
    attachment="bends.npz",
    learn=BendModel.learn,
    exclude=BendModel.without,
    apply=_apply,
    directions=lambda model: model.directions,
    fits=True,
)
"""Bends of the sheet; its model is a :class:`BendModel`."""
