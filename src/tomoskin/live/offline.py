"""The frame flow over a recording: reference, images and touches without a clock."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tomoskin.core import DataError, FloatArray, IntArray, Touch
from tomoskin.live.prepare import Prepared
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
    """

    frames: IntArray
    left_out: IntArray
    images: FloatArray
    unit: str
    touches: tuple[tuple[Touch, ...], ...]
    agreement: float

    def numbered_from(self, first: int) -> Reconstruction:
        """Frames counted from ``first``, for a part of a longer recording."""
        return replace(self, frames=self.frames + first, left_out=self.left_out + first)


def reconstruct(
    prepared: Prepared, recording: Recording, idle: NDArray[Any] | None
) -> Reconstruction:
    """Reconstruct every frame of ``recording``, whose rows are in the pattern's order.

    Parameters
    ----------
    idle
        (n_idle, n_meas) frames of the untouched skin; None where the recording holds
        differences.

    Raises
    ------
    DataError
        When the reference does not look like this skin, or no frame is left.
    """
    finite = np.isfinite(recording.voltages).all(axis=1)
    if not finite.any():
        raise DataError("no frame has finite values in every row", where=recording.source)
    values = recording.voltages[finite]
    if idle is None:
        changes, floor, agreement = _given_changes(prepared, recording, values), None, np.nan
    else:
        changes, floor, agreement = _changes(prepared, recording.source, values, idle)
    frames = np.flatnonzero(finite)
    images = np.stack([prepared.operator.quick(dv).values for dv in changes])
    return Reconstruction(
        frames=frames,
        left_out=np.flatnonzero(~finite),
        images=images,
        unit=prepared.operator.unit,
        touches=_touches(prepared, images, recording.time[frames], floor),
        agreement=agreement,
    )


def _changes(
    prepared: Prepared, source: str, values: NDArray[Any], idle: NDArray[Any]
) -> tuple[FloatArray, NoiseFloor | None, float]:
    operator, model = prepared.operator, prepared.operator.reference
    mean = idle.mean(axis=0)
    real_values, _ = in_phase(values, mean, model)
    reference = Reference.of(in_phase(idle, mean, model)[0])
    agreement = _agreement(reference.mean, model, source)
    if operator.difference == "plain":
        _check_scale(reference.mean, model, source)
    dv = difference(real_values, reference.mean, operator.difference)
    return dv, prepared.noise_floor(reference), agreement


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
    prepared: Prepared, images: FloatArray, times: FloatArray, floor: NoiseFloor | None
) -> tuple[tuple[Touch, ...], ...]:
    tracker = Tracker(patience=0, debounce=1)
    return tuple(
        tracker.update(prepared.segmenter(image, floor), float(time))
        for image, time in zip(images, times, strict=True)
    )
