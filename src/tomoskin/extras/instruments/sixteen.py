"""Import of tank recordings with 16 electrodes and neighbouring pairs, 256 values a frame.

EIDORS' sample recordings in the form ``v`` (n_frames, 256), ``inj`` and ``meas`` (256, 2),
``valid`` (256,); optional ``v_ref`` (256,), ``fps`` and ``electrode_xy`` (…, 16, 2). Three
things differ from file to file and are recognised from the data themselves:

- layout: a full 16 × 16 scan, or 208 values packed drive by drive from the pair behind the
  driven one on (the remaining 48 are auxiliary). Reciprocity holds in the right one only.
- polarity: a body without inner sources gives positive values for a sink at k, a source at
  k + 1 and φ[j] − φ[j + 1]; where the sum is negative, source and sink are exchanged.
- numbering: E1 towards +x, counter-clockwise, unless ``electrode_xy`` says otherwise. It is
  brought to the built-in skins': E1 at the top, clockwise.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from tomoskin.core import (
    Arrays,
    DataError,
    FloatArray,
    IntArray,
    electrode_table,
    numbers,
    real_numbers,
    refuse_first,
)
from tomoskin.files.imports import voltages_of
from tomoskin.sensing.signal import Recording, frame_times

_N = 16
_PACKED = _N * (_N - 3)


def detects(arrays: Arrays) -> bool:
    """Whether the keys are those of a 256-value tank recording."""
    return set(arrays) >= {"v", "inj", "meas", "valid"}


def parse(arrays: Arrays, source: str) -> Recording:
    """Return the recording with its valid rows, numbered as the built-in tank is.

    Raises
    ------
    DataError
        When a frame does not have 256 values, there is no frame or no signal in them, or an
        array beside them has the wrong shape or type.
    """
    voltages = np.atleast_2d(numbers(arrays, "v", source))
    if voltages.ndim != 2 or not len(voltages):
        raise DataError(f"expected frames v (n, {_N * _N}), got {voltages.shape}", where=source)
    _check_shape(voltages[0], (_N * _N,), "a frame of v", source)
    reference = numbers(arrays, "v_ref", source) if "v_ref" in arrays else None
    if reference is not None:
        _check_shape(reference, (_N * _N,), "v_ref", source)
    columns, drive, measure = _layout(arrays, source, voltages)
    values = voltages[:, columns]
    if np.nansum(values.real) < 0:
        drive = drive[:, ::-1]
    number = _numbering(arrays, source)
    return voltages_of(
        source,
        values,
        (number[drive], number[measure]),
        time=_times(arrays, len(voltages), source),
        reference=None if reference is None else reference[columns],
    )


def _layout(
    arrays: Arrays, source: str, voltages: NDArray[Any]
) -> tuple[IntArray, IntArray, IntArray]:
    """Columns that hold measurements, and drive and measuring pair of each."""
    mark = real_numbers(arrays, "valid", source)
    _check_shape(mark, (_N * _N,), "valid", source)
    valid = np.flatnonzero(mark)
    full = (
        valid,
        _electrodes(arrays, "inj", source)[valid][:, ::-1],
        _electrodes(arrays, "meas", source)[valid],
    )
    k = np.repeat(np.arange(_N), _N - 3)
    j = (k + 2 + np.tile(np.arange(_N - 3), _N)) % _N
    pair = np.column_stack([np.arange(_N), (np.arange(_N) + 1) % _N])
    packed = (np.arange(_PACKED), pair[k][:, ::-1], pair[j])
    mean = np.nan_to_num(voltages, posinf=0.0, neginf=0.0).mean(axis=0)
    if not (mean[valid].any() and mean[:_PACKED].any()):
        raise DataError("holds no signal: every valid value is zero or NaN", where=source)
    return min(full, packed, key=lambda layout: _reciprocity_error(mean, *layout))


def _reciprocity_error(
    mean: NDArray[Any], columns: IntArray, drive: IntArray, measure: IntArray
) -> float:
    """Relative difference between rows and their reciprocals (Geselowitz 1971)."""
    table = np.full((_N, _N), np.nan, dtype=mean.dtype)
    table[drive[:, 1], measure[:, 0]] = mean[columns]
    return float(np.nansum(np.abs(table - table.T)) / np.nansum(np.abs(table)))


def _numbering(arrays: Arrays, source: str) -> IntArray:
    """(16,) number in the built-in skins' count of each electrode of the file."""
    angle = 2.0 * np.pi * np.arange(_N) / _N
    if "electrode_xy" in arrays:
        angle = _angles(real_numbers(arrays, "electrode_xy", source), source)
    step = 2.0 * np.pi / _N
    place = (np.pi / 2 - angle) / step
    direction = np.sign(np.sum(np.sin(np.diff(place) * step)))
    spread = place - direction * np.arange(_N)
    first = np.angle(np.mean(np.exp(1j * spread * step))) / step
    # halves round up, so that ties do not depend on the last bit
    number = (np.floor(first + 0.5 + 1e-9) + direction * np.arange(_N)) % _N
    return np.asarray(number, dtype=np.int64)


def _angles(xy: FloatArray, source: str) -> FloatArray:
    if xy.shape[-2:] != (_N, 2) or not xy.size or not np.isfinite(xy).all():
        raise DataError(
            f"expected finite positions electrode_xy (…, {_N}, 2), got shape {xy.shape}",
            where=source,
        )
    positions = xy.reshape(-1, _N, 2)[0]
    centred = positions - positions.mean(axis=0)
    return np.asarray(np.arctan2(centred[:, 1], centred[:, 0]))


def _times(arrays: Arrays, n: int, source: str) -> FloatArray | None:
    """(n,) s of frames at the file's rate; None where it does not say."""
    if "fps" not in arrays:
        return None
    fps = real_numbers(arrays, "fps", source)
    if fps.shape != () or not (np.isfinite(fps) and fps > 0):
        raise DataError(f"expected one fps above 0, got {fps.tolist()}", where=source)
    return frame_times(n, float(fps))


def _electrodes(arrays: Arrays, key: str, source: str) -> IntArray:
    table = electrode_table(arrays, key, source)
    _check_shape(table, (_N * _N, 2), key, source)
    most = f"electrodes from 0 (E1) to {_N - 1}"
    refuse_first(table.max(axis=1) >= _N, table, most, f"{source}, {key} row", DataError)
    return table


def _check_shape(array: NDArray[Any], shape: tuple[int, ...], key: str, source: str) -> None:
    if array.shape != shape:
        raise DataError(f"expected {key} of shape {shape}, got {array.shape}", where=source)
