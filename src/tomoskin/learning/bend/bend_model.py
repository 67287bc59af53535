"""Bends of a sheet: what they do to the data, and what the sheet remembers of them; and
how a frame is read: how far it is bent, and whether idle, bent, touched, both, or unknown."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Self

import numpy as np

from tomoskin.core import DataError, Detection, FloatArray, IntArray
from tomoskin.learning.bend.recorded_bends import BendExamples
from tomoskin.learning.kind import Applied, Conditions, FrameView, Kind, TouchFit
from tomoskin.sensing.fit import Response, Whitener, spots_of

_WIDTHS = (0.03, 0.08, 0.16, 0.3)
"""Half widths of the plays, in parts of the largest amplitude."""

_LAGS = (1.0, 30.0)
"""Time constants of what comes late, s."""


class Memory:
    """Features of mode amplitudes z: themselves, bent, and where ``remembers`` their past.

    The inverse of a sum of plays is a sum of plays again (Krejčí & Kuhnen 2001, IEE Proc. Control
    Theory Appl. 148, 185), so an angle is sought as a linear function of z, of z·|z|, of plays of
    z and of z as it comes through low passes.

    Parameters
    ----------
    size
        Largest amplitude that was learnt from.
    plays
        Where the plays stand at the reference, as :meth:`plays_after` gives them; without it, in
        the middle, as in a sheet that has never been bent.
    """

    def __init__(
        self, n_modes: int, size: float, *, remembers: bool, plays: FloatArray | None = None
    ) -> None:
        self._size, self._remembers = size, remembers
        self._plays = np.zeros((len(_WIDTHS), n_modes)) if plays is None else plays
        self._late = np.zeros((len(_LAGS), n_modes))
        self._time: float | None = None

    def push(self, z: FloatArray, time: float) -> FloatArray:
        """(f,) features of amplitudes ``z`` (k,) at ``time`` s; frames in order."""
        step = 0.0 if self._time is None else max(time - self._time, 0.0)
        self._time = time
        curved = z * np.linalg.norm(z) / self._size
        if not self._remembers:
            return np.concatenate([z, curved])
        width = self._size * np.array(_WIDTHS)[:, None]
        self._plays = np.clip(self._plays, z - width, z + width)
        kept = np.exp(-step / np.array(_LAGS))[:, None]
        self._late = z + (self._late - z) * kept
        lead = slice(0, min(3, len(z)))  # what is small has no past to speak of
        past = (self._plays[:, lead].ravel(), self._late[:, lead].ravel())
        return np.concatenate([z, curved, *past])

    @classmethod
    def over(
        cls,
        z: FloatArray,
        time: FloatArray,
        size: float,
        *,
        remembers: bool,
        plays: FloatArray | None = None,
    ) -> FloatArray:
        """(n, f) features of a whole recording, from its rest on."""
        memory = cls(z.shape[1], size, remembers=remembers, plays=plays)
        return np.array([memory.push(row, float(t)) for row, t in zip(z, time, strict=True)])

    @classmethod
    def plays_after(cls, z: FloatArray, size: float) -> FloatArray:
        """(w, k) where the plays stand once a sheet has been through ``z`` (n, k) and is back."""
        memory = cls(z.shape[1], size, remembers=True)
        for row in (*z, np.zeros(z.shape[1])):
            memory.push(row, 0.0)
        return memory._plays


_ABOVE = 1.1
"""A direction counts above so many times the edge of noise."""

_MOST = 8

_WORTH = 0.5
"""The past counts where squared errors fall to this part by it: else it is chance."""

_FOLDS = 5
_RIDGES = np.geomspace(1e-6, 1.0, 13)


@dataclass(frozen=True, eq=False)
class BendModel:
    """Deformation modes of a skin and what their amplitudes say; made by :meth:`learn`.

    Attributes
    ----------
    examples
        What it was learnt from.
    covariance
        (n_meas, n_meas) V² of one frame less the reference.
    directions
        (n_meas, k) V: where bends move the data, orthonormal in units of the noise.
    weights
        (f, t) from features (:class:`Memory`) to the targets of the examples.
    plays
        Where the plays of :class:`Memory` stand at the reference; None where the sheet's past
        does not count.
    errors
        (n, t) rad, what the examples' targets are missed by when their part of the recording is
        left out.
    size
        Largest amplitude, for the features.
    """

    examples: BendExamples
    covariance: FloatArray
    directions: FloatArray
    weights: FloatArray
    plays: FloatArray | None
    errors: FloatArray
    size: float

    @classmethod
    def learn(cls, examples: BendExamples, covariance: FloatArray) -> Self:
        """From frames that nothing touches.

        Directions are the principal ones of the whitened frames above the edge of noise
        (Marchenko & Pastur 1967). The angle is a ridge regression on their amplitudes; whether
        the past counts, and the ridge, are what errs least on left-out fifths of the recording.
        A sheet that remembers is taken to have been bent so before its reference was taken, as
        it will have been whenever it is used.

        Raises
        ------
        DataError
            When the bends do not show above the noise, or the covariance is of other rows.
        """
        n_meas = examples.dv.shape[1]
        if covariance.shape != (n_meas, n_meas):
            raise DataError(f"expected {n_meas} rows of covariance, got shape {covariance.shape}")
        whiten = Whitener.of(covariance)
        whitened = whiten(examples.dv)
        _, singular, rows = np.linalg.svd(whitened, full_matrices=False)
        edge = np.sqrt(whitened.shape[1]) + np.sqrt(len(whitened))
        count = min(int(np.count_nonzero(singular > _ABOVE * edge)), _MOST)
        if count == 0:
            raise DataError(
                "the changes by the bends are not larger than the noise",
                hint="bend the skin farther, or check that the angles belong to these frames",
            )
        directions = np.linalg.pinv(whiten.matrix) @ rows[:count].T
        z = whitened @ rows[:count].T
        size = float(np.linalg.norm(z, axis=1).max())
        plays, weights, errors = min(
            ((plays, *_regressed(_features(z, examples, size, plays), examples))
             for plays in (None, Memory.plays_after(z, size))),
            key=lambda fit: np.mean(fit[2] ** 2) * (_WORTH if fit[0] is None else 1.0),
        )  # fmt: skip
        return cls(examples, covariance, directions, weights, plays, errors, size)

    def without(self, rows: IntArray) -> BendModel:
        """Learnt again from the rows that are left without ``rows`` (k,), indices.

        Raises DataError when the bends do not show in these.
        """
        kept = np.delete(np.arange(len(self.covariance)), rows)
        examples = replace(self.examples, dv=self.examples.dv[:, kept])
        return self.learn(examples, self.covariance[np.ix_(kept, kept)])

    @property
    def remembers(self) -> bool:
        """Whether the sheet's past counts."""
        return self.plays is not None

    def memory(self) -> Memory:
        """Of a sheet at its reference."""
        return Memory(self.n_modes, self.size, remembers=self.remembers, plays=self.plays)

    @property
    def n_modes(self) -> int:
        """The number of directions in which a bend moves the data."""
        return int(self.directions.shape[1])

    @cached_property
    def whiten(self) -> Whitener:
        """The transform that makes the noise white."""
        return Whitener.of(self.covariance)

    @cached_property
    def error(self) -> float:
        """Rad, root mean square by which left-out angles are missed."""
        return float(np.sqrt(np.mean(self._angles(self.examples.targets - self.errors) ** 2)))

    def _angles(self, targets: FloatArray) -> FloatArray:
        return np.asarray(self.predict(targets)[0] - self.examples.angle)

    def predict(self, targets: FloatArray) -> tuple[FloatArray, FloatArray]:
        """(n,) angle and axis, rad, of ``targets`` (n, t)."""
        if targets.shape[1] == 1:
            axes = self.examples.axes
            return targets[:, 0], np.full(len(targets), axes[0])
        trace, cosine, sine = targets.T
        sign = np.where(trace < 0, -1.0, 1.0)
        size = (np.abs(trace) + np.hypot(cosine, sine)) / 2
        return sign * size, np.mod(np.arctan2(sign * sine, sign * cosine) / 2, np.pi)


def _features(
    z: FloatArray, examples: BendExamples, size: float, plays: FloatArray | None
) -> FloatArray:
    remembers = plays is not None
    return Memory.over(z, examples.time, size, remembers=remembers, plays=plays)


def _regressed(features: FloatArray, examples: BendExamples) -> tuple[FloatArray, FloatArray]:
    """Weights and left-out errors of the ridge that errs least."""
    targets, scale = examples.targets, np.abs(features).max(axis=0) + 1e-12
    x = features / scale
    fold = np.arange(len(x)) * _FOLDS // len(x)
    candidates = []
    for ridge in _RIDGES:
        errors = np.zeros_like(targets)
        for k in range(_FOLDS):
            out = fold == k
            errors[out] = targets[out] - x[out] @ _ridge(x[~out], targets[~out], ridge)
        candidates.append((float(np.mean(errors**2)), ridge, errors))
    _, ridge, errors = min(candidates, key=lambda one: one[0])
    return _ridge(x, targets, ridge) / scale[:, None], errors


def _ridge(x: FloatArray, y: FloatArray, ridge: float) -> FloatArray:
    return np.asarray(np.linalg.solve(x.T @ x + ridge * np.eye(x.shape[1]), x.T @ y))


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
