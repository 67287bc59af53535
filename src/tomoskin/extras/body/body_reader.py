"""How a frame is read: the state of the body, and whether the skin is idle, bent, touched, both, or
unknown."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from tomoskin.core import Detection, FloatArray
from tomoskin.extras.body.body_model import TENSOR, BodyModel
from tomoskin.learning import (
    Applied,
    Conditions,
    FrameView,
    Kind,
    Reading,
    ShownReading,
    TouchFit,
)
from tomoskin.sensing.fit import Response, spots_of
from tomoskin.sensing.signal import independent
from tomoskin.sensing.track import RESIDUAL

_BENT = 3.0
"""Deviations by which a state must stand out of rest to be called a bend."""

_LIKE = 2.0
"""Times the noise that may be left unexplained."""

_ROUGH = 0.15
"""Part of what touches and bends change that their models may miss."""

_STEPS, _NEAR = 8, 1e-4
"""Of Gauss and Newton, and the step, in parts of a coordinate's largest, that ends them."""

_ANOTHER = 1.5
"""By how much another motion errs more than a part of the same that was left out: chosen on the
twins 11 and 9601."""

_FADES = 30.0
"""Seconds in which what touches have left behind fades."""

_WANDER = 1.0
"""Deviation of a state about the one before, in parts of the largest: it may be anything."""

_BEYOND = 0.1
"""Part of the learnt range beyond which a state is outside, and by three times that no farther."""


_WORDS = {
    "idle": "not bent",
    "bend": "bent",
    "touch": "touched, not bent",
    "bend and touch": "bent and touched",
    "unknown": "neither a bend nor a touch explains this",
}
"""States as people read them, where an angle was learnt, and where none was."""

_WORDS_WITHOUT_ANGLE = {
    "idle": "at rest",
    "bend": "moved",
    "touch": "touched, at rest",
    "bend and touch": "moved and touched",
    "unknown": "neither the body nor a touch explains this",
}


def _fixed(value: float, decimals: int) -> str:
    """A number as the page writes it; a dash where it is none."""
    if not np.isfinite(value):
        return "–"
    text = f"{abs(value):.{decimals}f}"
    return f"−{text}" if value < 0 and float(text) else text


def _degrees(angle: float, decimals: int = 0) -> str:
    return f"{_fixed(float(np.degrees(angle)), decimals)}°"


@dataclass(frozen=True, slots=True)
class BodyReading(Reading):
    """How the body stands in one frame.

    Attributes
    ----------
    names
        (d,) of the coordinates.
    values, deviations
        (d,) the coordinates, and their standard deviations.
    angle, sd
        Rad, of a bend, and its standard deviation; NaN where no angle was learnt.
    axis
        Rad from u, from 0 to π.
    state
        "idle", "bend", "touch", "bend and touch", or "unknown" for a change that neither the body
        nor touches explain.
    moved
        (n_meas,) V that the body adds to the reference.
    problem
        What is wrong with the state, in a sentence, or None.
    """

    key: ClassVar[str] = "bend"
    listed: ClassVar[str] = "bends"
    names: tuple[str, ...]
    values: FloatArray
    deviations: FloatArray
    angle: float
    sd: float
    axis: float
    state: str
    moved: FloatArray
    problem: str | None = None

    @property
    def besides_angle(self) -> list[tuple[str, float, float]]:
        """Name, value and deviation of each coordinate that the bend does not tell."""
        own = zip(self.names, self.values.tolist(), self.deviations.tolist(), strict=True)
        return [one for one in own if one[0] not in ("angle", *TENSOR)]

    @property
    def facts(self) -> dict[str, Any]:
        """For programs; an angle that was not learnt is None."""
        own = zip(self.names, self.values.tolist(), self.deviations.tolist(), strict=True)
        return {
            **self._bend,
            "body": {name: {"value": value, "sd": away} for name, value, away in own},
            "problem": self.problem,
        }

    @property
    def now(self) -> dict[str, Any]:
        """The bend, and beside it the coordinates that it does not tell."""
        others = [{"name": name, "value": at, "sd": sd} for name, at, sd in self.besides_angle]
        return {**self._bend, "coordinates": others}

    @property
    def _bend(self) -> dict[str, Any]:
        angle, sd = (None if np.isnan(one) else one for one in (self.angle, self.sd))
        return {"angle_rad": angle, "sd_rad": sd, "axis_rad": self.axis, "state": self.state}

    @property
    def word(self) -> str:
        """The state."""
        return self.state

    @property
    def is_rest(self) -> bool:
        """Whether it stands as when the reference is taken."""
        return self.state == "idle"

    @property
    def shown(self) -> ShownReading:
        """The angle in large figures, the others below it, and the state in words."""
        notes = tuple(
            f"{name} {_fixed(value, _decimals(sd))} ± {_fixed(sd, _decimals(sd))}"
            for name, value, sd in self.besides_angle
        )
        unknown = self.state == "unknown"
        if np.isnan(self.angle):
            words = _WORDS_WITHOUT_ANGLE[self.state]
            return ShownReading(words, f"Body: {words}", "sheet", unknown, notes=notes)
        words = _WORDS[self.state]
        angle, sd, axis = _degrees(self.angle), _degrees(self.sd, 1), _degrees(self.axis)
        by, sentence = f"{angle} ± {sd} about an axis {axis} from x", f"Body: {words}"
        if self.state not in ("idle", "touch"):
            sentence += f"; bent by {by} if anything" if unknown else f" by {by}"
        return ShownReading(
            words,
            sentence,
            "sheet",
            unknown,
            unit="bend",
            value=angle,
            deviation=f"± {sd}, axis {axis}",
            drawn=(self.angle, self.axis),
            notes=notes,
        )

    @property
    def text(self) -> str:
        """The state in words, for one line of a report."""
        shown = "body" if np.isnan(self.angle) else f"bend {np.degrees(self.angle):.0f}°"
        return f"{shown} ({self.state})"


def _decimals(sd: float) -> int:
    """That show a deviation with one or two digits."""
    return min(6, max(0, 1 - int(np.floor(np.log10(sd))))) if sd > 0 else 6


class BodyReader:
    """Reads one frame after the other; it remembers what the sheet does.

    Parameters
    ----------
    model
        Learnt from a recorded motion.
    response
        The forward model with touches on it.
    gain
        Of measured voltages against the model's.
    """

    def __init__(self, model: BodyModel, response: Response, gain: float = 1.0) -> None:
        self._model, self.response, self.gain = model, response, gain
        self.modes = model.whiten(model.directions.T).T
        self._memory = model.memory()
        span = model.body.state / model.body.size
        self._low = np.minimum(span.min(axis=0), 0.0)
        self._high = np.maximum(span.max(axis=0), 0.0)
        self._x = np.zeros(span.shape[1])
        self._left = self._pressed = np.zeros((model.n_modes, model.n_modes))
        self._time = -np.inf

    def push(
        self,
        dv: FloatArray,
        detections: Sequence[Detection],
        common: FloatArray,
        time: float,
        *,
        touched: bool = True,
    ) -> BodyReading:
        """Read ``dv`` (n_meas,) V less the skin at rest, at ``time`` s.

        ``detections`` are the touches fitted to it; ``common`` (n_meas, k) directions that say
        nothing. The state is fitted beside what the touches change, their places, sizes, strengths
        and directions free to first order. ``touched`` is False where none of them is a touch to
        one who has seen the frames before.
        """
        model = self._model
        self._left = self._left * np.exp((self._time - time) / _FADES)
        self._time = time
        z, weights, strange = self._amplitudes(dv, detections, common)
        x, spread = self._solved(z, weights, time)
        self._memory.push(x, time)
        self._x = x
        deviations = model.body.size * np.sqrt(np.diag(spread))
        values = model.body.size * x
        bent = bool((np.abs(values) > _BENT * deviations).any())
        angle, sd, axis = _bend(model, values, deviations)
        return BodyReading(
            names=model.body.names,
            values=values,
            deviations=deviations,
            angle=angle,
            sd=sd,
            axis=axis,
            state=_state(bent, bool(detections) and touched, strange),
            moved=model.directions @ z,
            problem=self._problem(x),
        )

    def _amplitudes(
        self, dv: FloatArray, detections: Sequence[Detection], common: FloatArray
    ) -> tuple[FloatArray, FloatArray, bool]:
        """(k,) amplitudes of the directions, (k, k) their inverse covariance, and whether much of
        the frame is explained by nothing."""
        model, modes = self._model, self.modes
        change, free = self._touches(detections)
        data = model.whiten(dv) - change
        self._press(change)
        blind = independent(np.hstack([model.whiten(common.T).T, free]))
        data, modes = (part - blind @ (blind.T @ part) for part in (data, modes))
        information = modes.T @ modes
        z = np.asarray(np.linalg.lstsq(information, modes.T @ data, rcond=1e-9)[0], np.float64)
        residual = data - modes @ z
        degrees = max(len(data) - blind.shape[1] - model.n_modes, 1)
        missed = float(residual @ residual)
        weights = information / max(missed / degrees, 1.0)
        excess = _ANOTHER**2 * model.excess + self._left + self._pressed
        weights = np.linalg.solve(np.eye(model.n_modes) + weights @ excess, weights)
        explained = float(np.sum(model.whiten(dv) ** 2)) * _ROUGH**2
        return z, (weights + weights.T) / 2, missed > _LIKE**2 * degrees + explained

    def _press(self, change: FloatArray) -> None:
        """Take what touches ``change`` (r,), whitened: as much as a part of it along the body's
        directions, whichever way, may be missed, and stays behind when they are lifted."""
        if not change.any():
            self._left, self._pressed = self._left + self._pressed, 0.0 * self._pressed
            return
        along = RESIDUAL.part / 2 * (self.modes.T @ change)
        self._pressed = float(along @ along) * np.eye(len(along))

    def _solved(
        self, z: FloatArray, weights: FloatArray, time: float
    ) -> tuple[FloatArray, FloatArray]:
        """The likeliest state for amplitudes ``z`` (k,) of inverse covariance ``weights``, and its
        covariance: Gauss–Newton on the manifold from the state before."""
        x, prior = self._x, np.eye(len(self._x)) / _WANDER**2
        margin = 3 * _BEYOND * (self._high - self._low)
        normal = prior
        for _ in range(_STEPS):
            at, slopes = self._model.expanded(self._memory, x, time)
            normal = slopes.T @ weights @ slopes + prior
            pull = slopes.T @ weights @ (z - at) - prior @ (x - self._x)
            step = np.clip(np.linalg.solve(normal, pull), -0.5, 0.5)
            x = np.clip(x + step, self._low - margin, self._high + margin)
            if np.abs(step).max() < _NEAR:
                break
        off = z - self._model.expanded(self._memory, x, time)[0]
        misfit = float(off @ weights @ off) / max(len(z) - len(x), 1)
        return x, np.asarray(np.linalg.inv(normal) * max(misfit, 1.0), np.float64)

    def _problem(self, x: FloatArray) -> str | None:
        margin = _BEYOND * (self._high - self._low)
        outside = np.flatnonzero((x < self._low - margin) | (x > self._high + margin))
        if not len(outside):
            return None
        name = self._model.body.names[outside[0]]
        return (
            f"the {name} of the body is outside what was learnt: touches are still found, but may "
            "be misplaced; move through this pose too and run tomoskin calibrate body again"
        )

    def _touches(self, detections: Sequence[Detection]) -> tuple[FloatArray, FloatArray]:
        """(r,) what they change, whitened, and (r, c) its derivatives."""
        whiten = self._model.whiten
        if not detections:
            return np.zeros(len(self.modes)), np.zeros((len(self.modes), 0))
        conductivity = float(np.mean(self.response.state.conductivity))
        spots = np.array([_spot_of(detection, conductivity) for detection in detections])
        change, slopes, towards = self.response.expanded(spots)
        rows = self.gain * np.column_stack([change, slopes, towards]).T
        whitened = whiten(rows)
        return whitened[0], whitened[1:].T


def _bend(
    model: BodyModel, values: FloatArray, deviations: FloatArray
) -> tuple[float, float, float]:
    """Angle of a bend, its deviation and its axis, rad; NaN where no angle was learnt."""
    body = model.body
    if body.turns:
        trace, cosine, sine = values.tolist()
        sign = -1.0 if trace < 0 else 1.0
        angle = sign * (abs(trace) + float(np.hypot(cosine, sine))) / 2
        axis = float(np.mod(np.arctan2(sign * sine, sign * cosine) / 2, np.pi))
        return angle, float(deviations[0]), axis
    if "angle" not in body.names:
        return np.nan, np.nan, float(body.axis)
    number = body.names.index("angle")
    return float(values[number]), float(deviations[number]), float(body.axis)


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


class BodyApplied(Applied):
    """Reads how the body stands, beside the touches of each frame.

    A state is told beside a touch only where what the touch changes is known, so that touches
    are fitted to the data here where the skin finds its own in the image.
    """

    def __init__(self, model: BodyModel, fit: TouchFit) -> None:
        self._reader = BodyReader(model, fit.response, fit.gain)
        self._detect = fit.detect
        self.poses = model.whiten(model.examples.dv) @ self._reader.modes @ model.directions.T

    def renew(self, response: Response, gain: float) -> None:
        """Go on with touches on another sheet."""
        self._reader.response, self._reader.gain = response, gain

    def read(self, view: FrameView, detections: list[Detection], *, touched: bool) -> BodyReading:
        """How the body stands in this frame."""
        touches = self._detect(view, detections)
        data = view.differences
        reading = self._reader.push(data.change, touches, data.drift, view.time, touched=touched)
        self.moved = reading.moved
        return reading


def _apply(model: BodyModel, conditions: Conditions) -> Applied:
    fit = conditions.touch_fit()
    return Applied() if fit is None else BodyApplied(model, fit)


BODY = Kind(
    name="body",
    title="tomoskin bend calibration",
    subject="the body's motion",
    attachment="bends.npz",
    learn=BodyModel.learn,
    exclude=BodyModel.without,
    apply=_apply,
    directions=lambda model: model.directions,
    reading=BodyReading,
    fits=True,
)
"""The body's motion; its model is a :class:`BodyModel`. Title and attachment are older than the
name."""
