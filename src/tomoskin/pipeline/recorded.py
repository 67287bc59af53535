"""A recording as the pipeline takes it: frames and measurements that serve, and a reference."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from itertools import pairwise
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from tomoskin.core import DataError, FloatArray, IntArray
from tomoskin.imaging import MOST_EXCLUDED
from tomoskin.model.pattern import Pattern
from tomoskin.pipeline.conditioning import MOST_NUISANCE
from tomoskin.pipeline.frame_result import NO_AGREEMENT, REFUSED, ModelAgreement
from tomoskin.pipeline.prepare import Prepared
from tomoskin.sensing.signal import Recording, Reference, difference, in_phase

_LISTED = 5
"""Measurements that a message names."""

_MOST_SCALE = 30.0
"""Plain differences are refused where voltages and model differ in size by more than this."""

_STILL = 1e-9
"""Idle values within this part of their size of each other are the same but for arithmetic."""

Idle = range | NDArray[Any] | Literal["previous"] | None
"""Frames of the untouched skin: a range of the recording's own, or (n_idle, n_meas) of another;
"previous" for dynamic imaging, each frame against the one before it; None where the recording holds
differences."""


@dataclass(frozen=True, eq=False)
class RecordedFrames:
    """Frames of a recording as the pipeline takes them.

    Attributes
    ----------
    prepared
        The skin without the measurements that are excluded, ``n_meas`` of them left; alpha chosen
        for these.
    recording
        Where they are from.
    rows_left_out
        (r,) measurements of the skin's pattern that are excluded from the whole recording.
    notes
        Why they are, in sentences.
    values
        (n, n_meas) V, or difference data where there is no reference; NaN where they are not
        known in the frame, or in the one that it is held against.
    first
        Index in the recording of the first of the frames; the others follow it.
    reference
        Mean and noise of the idle frames; None where there are none.
    agreement
        Of the reference with the model's voltages.
    idle
        (n_idle, n_meas) V, the frames of which the reference is; none where there are differences.
    idle_frames
        (n_idle,) indices of these in the recording; −1 for those of another.
    """

    prepared: Prepared
    recording: Recording
    rows_left_out: IntArray
    values: NDArray[Any]
    notes: tuple[str, ...] = ()
    first: int = 0
    reference: Reference | None = None
    agreement: ModelAgreement = NO_AGREEMENT
    idle: FloatArray = field(default_factory=lambda: np.zeros((0, 0)))
    idle_frames: IntArray = field(default_factory=lambda: np.zeros(0, dtype=np.int64))

    @property
    def frames(self) -> IntArray:
        """(n,) indices of the frames in the recording."""
        return np.arange(self.first, len(self.recording))

    @property
    def missing(self) -> NDArray[np.bool_]:
        """(n, n_meas) values that are not known."""
        return np.asarray(~np.isfinite(self.values))

    @property
    def time(self) -> FloatArray:
        """(n,) s, later from frame to frame."""
        return self.recording.time[self.first :]

    @property
    def interval(self) -> float:
        """Between frames, s; NaN where there is a single one."""
        time = self.time
        return float(np.median(np.diff(time))) if len(time) > 1 else np.nan

    @property
    def idle_time(self) -> list[float]:
        """(n_idle,) s: as recorded where the recording begins with them, else just before it."""
        own, n, time = self.idle_frames, len(self.idle), self.recording.time
        others = np.setdiff1d(self.frames, own)
        if n and own[0] >= 0 and (not len(others) or own[-1] < others[0]):
            return list(map(float, time[own]))
        interval = self.interval if len(time) > 1 else 1.0
        begin = time[others[0]] if len(others) else 0.0
        return [float(begin - interval * before) for before in range(n, 0, -1)]

    @property
    def rounding(self) -> FloatArray | float:
        """V below which no measurement's noise is; see :class:`Reference`."""
        return 0.0 if self.reference is None else self.reference.least

    @property
    def differences(self) -> FloatArray:
        """(n, n_meas) in the operator's kind of difference; zero where missing."""
        dv = self.values
        if self.reference is not None:
            dv = difference(dv, self.reference.mean, self.prepared.operator.difference)
        return np.where(self.missing, 0.0, dv)

    @property
    def noise(self) -> FloatArray | None:
        """(n_meas,) deviation of difference data; None where the recording does not tell it."""
        if self.reference is None or not self.reference.noise_is_known:
            return None
        return self.prepared.difference_noise(self.reference)


def recorded_frames(prepared: Prepared, recording: Recording, idle: Idle) -> RecordedFrames:
    """The frames of ``recording``, whose rows are in the pattern's order.

    Raises
    ------
    DataError
        When the rows are not in the pattern's order, the reference does not look like this
        skin, or too few frames or rows are left.
    """
    pattern, recording = prepared.pattern, recording.plausible().steady()
    prepared.operator.accept(
        Pattern.from_tables(recording.drive, recording.measure, pattern.n_electrodes)
    )
    own = np.array(idle if isinstance(idle, range) else (), dtype=np.int64)
    if isinstance(idle, range):
        idle = recording.voltages[own]
    rest = None if isinstance(idle, str) else idle
    dead, notes = _excluded(prepared, recording, rest)
    living = np.delete(recording.voltages, dead, axis=1)
    frames = RecordedFrames(prepared.without(dead), recording, dead, living, notes)
    if (frames.missing.mean(axis=1) > MOST_NUISANCE).all():
        raise DataError("no frame has finite values in enough rows", where=recording.source)
    if idle is None:
        return replace(frames, values=_given(frames))
    if isinstance(idle, str):
        return _against_the_one_before(frames)
    idle = np.delete(idle, dead, axis=1)
    complete = _complete(idle, recording.source)
    values, quiet, agreement = _in_volts(frames, idle[complete])
    return replace(
        frames,
        values=values,
        reference=Reference.of(quiet, _rounding(frames.prepared, quiet)),
        agreement=agreement,
        idle=quiet,
        idle_frames=own[complete] if len(own) else np.full(len(quiet), -1),
    )


def _excluded(
    prepared: Prepared, recording: Recording, idle: NDArray[Any] | None
) -> tuple[IntArray, tuple[str, ...]]:
    """(r,) rows of the whole recording that say nothing, and why, in sentences."""
    pattern, notes = prepared.pattern, []
    dead = dead_rows(recording.voltages, idle, pattern, recording.source)
    reasons = [(dead, "hold no finite values and were left out")]
    if idle is not None and prepared.operator.difference == "normalised":
        zero = np.flatnonzero(~idle.any(axis=0))
        reasons.append((zero, "are zero in the reference, by which none can be divided: left out"))
    for rows, text in reasons:
        if len(rows):
            listed = "; ".join(map(pattern.row_text, rows.tolist()))
            notes.append(f"{len(rows)} rows {text}: {listed}")
    excluded = np.concatenate([rows for rows, _ in reasons])
    if idle is not None and not recording.board_known:
        own, names = _of_open_electrodes(prepared, idle, excluded)
        if names:
            notes.append(
                f"{names} read as if they were open, far off from what the skin's model expects: "
                f"their {len(own)} of {pattern.n_meas} rows were left out"
            )
            excluded = np.concatenate([excluded, own])
    return np.unique(excluded), tuple(notes)


def _of_open_electrodes(
    prepared: Prepared, idle: NDArray[Any], excluded: IntArray
) -> tuple[IntArray, str]:
    """(r,) rows of electrodes without contact, and their names, by rows that are not excluded."""
    pattern = prepared.pattern
    measured = np.full(pattern.n_meas, np.nan, idle.dtype)
    kept = np.setdiff1d(np.arange(pattern.n_meas), excluded)
    finite = np.isfinite(idle[:, kept])
    measured[kept] = np.where(finite, idle[:, kept], 0.0).sum(axis=0) / finite.sum(axis=0)
    lost = open_electrodes(pattern, measured, prepared.problem.reference)
    own = [pattern.rows_of(electrode) for electrode in lost]
    rows = np.unique(np.concatenate([np.zeros(0, np.int64), *own]))
    return rows, ", ".join(f"E{electrode + 1}" for electrode in lost)


def _complete(idle: NDArray[Any], source: str) -> NDArray[np.bool_]:
    """(n_idle,) bool: those with a value in every row: others would shift the mean."""
    complete = np.isfinite(idle).all(axis=1)
    if not complete.any():
        raise DataError(
            "no untouched frame has finite values in all rows that the other frames have",
            where=source,
            hint="choose other frames with --reference",
        )
    return np.asarray(complete)


def _rounding(prepared: Prepared, quiet: FloatArray) -> FloatArray:
    """(n_meas,) least noise: where idle frames are all the same, what the read-out would round.

    What recorded a row that wavers is not known, and may be finer than the skin's read-out.
    """
    model, mean = prepared.operator.reference, quiet.mean(axis=0)
    scale = float(np.linalg.norm(mean) / np.linalg.norm(model))
    still = np.ptp(quiet, axis=0) <= _STILL * np.linalg.norm(mean)
    return np.where(still, scale * prepared.readout.rounding, 0.0)


def _in_volts(
    frames: RecordedFrames, quiet: NDArray[Any]
) -> tuple[FloatArray, FloatArray, ModelAgreement]:
    """Values and idle frames as a real model has them, and how well they agree with it."""
    operator, source = frames.prepared.operator, frames.recording.source
    model, mean = operator.reference, quiet.mean(axis=0)
    values, _ = in_phase(frames.values, mean, model)
    quiet, _ = in_phase(quiet, mean, model)
    agreement = _agreement(quiet.mean(axis=0), model, source)
    if operator.difference == "plain":
        _check_scale(agreement.size, source)
    return values, quiet, agreement


def _against_the_one_before(frames: RecordedFrames) -> RecordedFrames:
    """Dynamic imaging; what a frame or the one before it lacks is missing."""
    if len(frames.values) < 2:
        raise DataError(
            f"expected at least two frames, got {len(frames.values)}",
            where=frames.recording.source,
        )
    missing = frames.missing
    values, mean, agreement = _in_volts(frames, frames.values.mean(axis=0, where=~missing)[None])
    kind, pairs = frames.prepared.operator.difference, pairwise(np.where(missing, mean, values))
    changes = np.array([difference(now, before, kind) for before, now in pairs])
    changes[missing[1:] | missing[:-1]] = np.nan
    return replace(frames, values=changes, first=1, agreement=agreement)


def _given(frames: RecordedFrames) -> FloatArray:
    """Differences of a file in the operator's kind of difference."""
    operator, recording, dv = frames.prepared.operator, frames.recording, frames.values
    if np.iscomplexobj(dv):
        raise DataError(
            "expected real dv, got complex", where=recording.source, hint="give voltages instead"
        )
    if operator.difference == "plain":
        return dv
    reference = operator.reference
    if recording.reference is not None:
        reference = np.delete(recording.reference.real, frames.rows_left_out)
    return difference(dv + reference, reference, operator.difference)


def _agreement(reference: FloatArray, model: FloatArray, source: str) -> ModelAgreement:
    agreement = ModelAgreement.of(reference, model)
    cosine = agreement.cosine
    if cosine <= -REFUSED:
        raise DataError(
            f"the voltages fit this skin with the sign reversed (agreement {cosine:.2f})",
            where=source,
            hint="swap source and sink, or plus and minus, in the file's tables",
        )
    if cosine < REFUSED:
        raise DataError(
            "the recording does not fit this skin: its reference agrees with the model by "
            f"{cosine:.2f}, expected close to 1",
            where=source,
            hint="check --skin, the order of the electrodes and --reference",
        )
    return agreement


def _check_scale(scale: float, source: str) -> None:
    if not 1 / _MOST_SCALE < scale < _MOST_SCALE:
        raise DataError(
            f"its voltages are {scale:.3g} times those of the skin's model",
            where=source,
            hint="give volts, correct the skin's current and sheet resistance, "
            'or set difference = "normalised" in its [inverse]',
        )


def dead_rows(
    values: NDArray[Any], idle: NDArray[Any] | None, pattern: Pattern, source: str
) -> IntArray:
    """(k,) rows that are not finite in most frames, or in most of the idle ones.

    Parameters
    ----------
    values, idle
        (n_frames, n_meas) and (n_idle, n_meas) in the order of ``pattern``, or None.
    source
        Where they came from, for messages.

    Raises
    ------
    DataError
        When so few rows are left that the picture would be mostly prior.
    """
    parts = [values] if idle is None else [values, idle]
    dead = [(~np.isfinite(part)).mean(axis=0) > 0.5 for part in parts]
    rows = np.flatnonzero(np.any(dead, axis=0))
    if len(rows) == pattern.n_meas:
        raise DataError("no frame has finite values", where=source)
    if len(rows) > MOST_EXCLUDED * pattern.n_meas:
        listed = "; ".join(pattern.row_text(row) for row in rows[:_LISTED])
        raise DataError(
            f"{len(rows)} of {pattern.n_meas} rows hold no finite values, which is too many to "
            f"leave out: {listed}; …",
            where=source,
        )
    return rows


_TIMES = 5.0
"""A measurement is off that is so many times the model's, or so many times less."""

_SMALL = 0.2
"""Below this part of their rms, what a model expects is too small for such a comparison."""

_OFF = 0.5
"""An electrode is open where at least this part of its measurements is off."""

_LEFT = 0.25
"""At least this part of the measurements stays, or nothing is said of electrodes."""


def open_electrodes(pattern: Pattern, measured: NDArray[Any], model: FloatArray) -> list[int]:
    """Electrodes without contact, by voltages (n_meas,) of the untouched skin; the model's too.

    Most of what they drive or read is off by far. The worst is left out first, then the scale of
    the others is taken again. Empty where too little would be left to judge by.
    """
    size, expected = np.abs(measured), np.abs(model)
    rows = np.hstack([pattern.drive, pattern.measure])
    kept, excluded = np.isfinite(size), list[int]()
    while kept.mean() >= _LEFT:
        scaled = expected * _size_over(size[kept], expected[kept])
        small = _SMALL * np.sqrt(np.mean(scaled[kept] ** 2))
        off = (size > _TIMES * np.maximum(scaled, small)) | (_TIMES * size < scaled - small)
        own = [(rows == e).any(axis=1) & kept for e in range(pattern.n_electrodes)]
        part = [float(off[mine].mean()) if mine.any() else 0.0 for mine in own]
        worst = int(np.argmax(part))
        if part[worst] < _OFF:
            return sorted(excluded)
        excluded.append(worst)
        kept &= ~own[worst]
    return []


def _size_over(size: FloatArray, expected: FloatArray) -> float:
    """Measured over expected, as most of all measurements have it to within a factor of two."""
    ratio = np.log(np.maximum(size, 1e-300) / np.maximum(expected, 1e-300))
    alike = (np.abs(ratio[:, None] - ratio) < np.log(2.0)).sum(axis=1)
    return float(np.exp(ratio[int(alike.argmax())]))
