"""The frame flow over a recording: reference, images and touches without a clock."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tomoskin.core import DataError, FloatArray, Image, IntArray, Touch
from tomoskin.inverse import AlphaChoice, Evidence
from tomoskin.live.dead_rows import as_the_model, dead_rows
from tomoskin.live.prepare import Prepared
from tomoskin.live.tune import tuned, tuned_by_rule
from tomoskin.pattern import Pattern
from tomoskin.session import Recording
from tomoskin.signal import Reference, difference, in_phase
from tomoskin.touch import NoiseFloor, Tracker

REFUSED = 0.3
DOUBTED = 0.8
"""Agreement of a recording's reference with the model's voltages (cosine, 1 = proportional):
below the first the recording is refused as another skin's, below the second it is doubted."""

_MOST_SCALE = 30.0
"""Plain differences are refused where voltages and model differ in size by more than this."""


@dataclass(frozen=True, eq=False)
class Reconstruction:
    """Images and touches of a recording.

    Attributes
    ----------
    frames
        (n,) indices in the recording of the frames that were reconstructed.
    left_out
        (k,) indices of those that hold values which are not finite.
    images
        (n, n_cells) change of conductivity, in ``unit``.
    touches
        One tuple a frame.
    agreement
        Cosine between the reference and the model's voltages, NaN where there is no reference.
    choice
        The alpha of the images, and what chose it.
    rows_left_out
        (r,) rows of the pattern that hold no finite values, left out of every image.
    """

    frames: IntArray
    left_out: IntArray
    images: FloatArray
    unit: str
    touches: tuple[tuple[Touch, ...], ...]
    agreement: float
    choice: AlphaChoice
    rows_left_out: IntArray

    def numbered_from(self, first: int) -> Reconstruction:
        """Frames counted from ``first``, for a part of a longer recording."""
        return replace(self, frames=self.frames + first, left_out=self.left_out + first)


@dataclass(frozen=True, eq=False)
class Changes:
    """Difference data of a recording.

    Attributes
    ----------
    frames, left_out
        Indices in the recording, as in :class:`Reconstruction`.
    values
        (n, n_meas) in the operator's kind of difference.
    places
        (n, 2) m, where the skin was touched, or None.
    reference
        Mean and noise of the idle frames; None where the recording holds differences.
    agreement, rows_left_out
        As in :class:`Reconstruction`.
    """

    frames: IntArray
    left_out: IntArray
    values: FloatArray
    places: FloatArray | None
    reference: Reference | None
    agreement: float
    rows_left_out: IntArray

    def evidence(self, prepared: Prepared) -> Evidence:
        """What the recording tells a rule that chooses alpha."""
        noise = None
        if self.reference is not None and self.reference.noise_is_known:
            noise = prepared.difference_noise(self.reference)
        return Evidence(
            noise=noise,
            frames=self.values,
            places=self.places,
            locate=prepared.places,
        )


def reconstruct(
    prepared: Prepared,
    recording: Recording,
    idle: NDArray[Any] | None,
    *,
    rule: str | None = None,
) -> Reconstruction:
    """Reconstruct every frame of ``recording``, whose rows are in the pattern's order.

    Parameters
    ----------
    idle
        (n_idle, n_meas) frames of the untouched skin; None where the recording holds
        differences.
    rule
        Chooses alpha from this recording, by a name of :data:`tomoskin.inverse.RULES`; without
        it the skin's alpha holds, "auto" at the noise of the idle frames.

    Raises
    ------
    DataError
        When the rows are not in the pattern's order, the reference does not look like this
        skin, too few frames or rows are left, or the recording lacks what the rule needs.
    ModelError
        When the rule is not known or finds no alpha.
    """
    changes = changes_of(prepared, recording, idle)
    prepared = _tuned(prepared, changes, rule)
    operator = prepared.operator.without(changes.rows_left_out)
    prepared = replace(prepared, operator=operator)
    floor = None if changes.reference is None else prepared.noise_floor(changes.reference)
    images = [operator.quick(dv) for dv in changes.values]
    times = recording.time[changes.frames]
    return Reconstruction(
        frames=changes.frames,
        left_out=changes.left_out,
        images=np.stack([image.values for image in images]),
        unit=operator.unit,
        touches=_touches(prepared, images, times, floor),
        agreement=changes.agreement,
        choice=prepared.choice,
        rows_left_out=changes.rows_left_out,
    )


def changes_of(prepared: Prepared, recording: Recording, idle: NDArray[Any] | None) -> Changes:
    """Difference data of every frame of ``recording``; parameters and errors as above."""
    pattern, model = prepared.pattern, prepared.operator.reference
    prepared.operator.accept(
        Pattern.from_tables(recording.drive, recording.measure, pattern.n_electrodes)
    )
    dead = dead_rows(recording.voltages, idle, pattern, recording.source)
    finite = np.isfinite(np.delete(recording.voltages, dead, axis=1)).all(axis=1)
    if not finite.any():
        raise DataError("no frame has finite values in every row", where=recording.source)
    values = recording.voltages[finite]
    if idle is None:
        dv, reference, agreement = _given_changes(prepared, recording, values), None, np.nan
    else:
        values, idle = as_the_model(values, idle, dead, model)
        dv, reference, agreement = _changes(prepared, recording.source, values, idle)
    dv[:, dead] = 0.0
    return Changes(
        frames=np.flatnonzero(finite),
        left_out=np.flatnonzero(~finite),
        values=dv,
        places=None if recording.labels is None else recording.labels[finite],
        reference=reference,
        agreement=agreement,
        rows_left_out=dead,
    )


def _tuned(prepared: Prepared, changes: Changes, rule: str | None) -> Prepared:
    if rule is not None:
        return tuned_by_rule(prepared, rule, changes.evidence(prepared))
    return prepared if changes.reference is None else tuned(prepared, changes.reference)


def _changes(
    prepared: Prepared, source: str, values: NDArray[Any], idle: NDArray[Any]
) -> tuple[FloatArray, Reference, float]:
    operator, model = prepared.operator, prepared.operator.reference
    mean = idle.mean(axis=0)
    real_values, _ = in_phase(values, mean, model)
    reference = Reference.of(in_phase(idle, mean, model)[0])
    agreement = _agreement(reference.mean, model, source)
    if operator.difference == "plain":
        _check_scale(reference.mean, model, source)
    dv = difference(real_values, reference.mean, operator.difference)
    return dv, reference, agreement


def _given_changes(prepared: Prepared, recording: Recording, dv: NDArray[Any]) -> FloatArray:
    """``dv`` of a file in the operator's kind of difference."""
    operator = prepared.operator
    if np.iscomplexobj(dv):
        raise DataError(
            "expected real dv, got complex", where=recording.source, hint="give voltages instead"
        )
    if operator.difference == "plain":
        return dv
    reference = operator.reference if recording.reference is None else recording.reference
    return difference(dv + reference.real, reference.real, operator.difference)


def _agreement(reference: FloatArray, model: FloatArray, source: str) -> float:
    length = float(np.linalg.norm(reference) * np.linalg.norm(model))
    cosine = float(reference @ model) / length if length else 0.0
    if cosine <= -REFUSED:
        raise DataError(
            f"the voltages are those of this skin with the sign reversed (agreement {cosine:.2f})",
            where=source,
            hint="exchange source and sink, or plus and minus, in its tables",
        )
    if cosine < REFUSED:
        raise DataError(
            f"does not look like this skin: its reference agrees with the model by {cosine:.2f}, "
            "expected close to 1",
            where=source,
            hint="check --skin, the order of the electrodes and --reference",
        )
    return cosine


def _check_scale(reference: FloatArray, model: FloatArray, source: str) -> None:
    scale = float(np.linalg.norm(reference) / np.linalg.norm(model))
    if not 1 / _MOST_SCALE < scale < _MOST_SCALE:
        raise DataError(
            f"its voltages are {scale:.3g} times those of the skin's model",
            where=source,
            hint="give volts, correct the skin's current and sheet resistance, "
            'or set difference = "normalised" in its [inverse]',
        )


def _touches(
    prepared: Prepared, images: list[Image], times: FloatArray, floor: NoiseFloor | None
) -> tuple[tuple[Touch, ...], ...]:
    tracker = Tracker(patience=0, debounce=1)
    return tuple(
        tracker.update(prepared.segmenter(image, floor), float(time))
        for image, time in zip(images, times, strict=True)
    )
