"""Import of tank recordings with 16 electrodes and neighbouring pairs, 256 values a frame.

EIDORS' sample recordings in the form ``v`` (n_frames, 256), ``inj`` and ``meas`` (256, 2),
``valid`` (256,); optional ``v_ref`` (256,), ``fps`` and ``electrode_xy`` (…, 16, 2). Three
things differ from file to file and are told from the data themselves:

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

from tomoskin.core import DataError, FloatArray, IntArray
from tomoskin.session.archive import Arrays
from tomoskin.session.interchange import electrode_table, numbers
from tomoskin.session.recording import Recording, frame_times

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
        When a frame does not have 256 values.
    """
    voltages = np.atleast_2d(numbers(arrays, "v", source))
    if voltages.shape[1] != _N * _N or arrays["valid"].shape != (_N * _N,):
        raise DataError(
            f"expected {_N * _N} values a frame with a valid mark each, "
            f"got v {voltages.shape} and valid {arrays['valid'].shape}",
            where=source,
        )
    reference = numbers(arrays, "v_ref", source) if "v_ref" in arrays else None
    columns, drive, measure = _layout(arrays, source, voltages)
    values = voltages[:, columns]
    if np.nansum(values.real) < 0:
        drive = drive[:, ::-1]
    number = _numbering(arrays, source)
    rate = float(arrays["fps"]) if "fps" in arrays else 1.0
    return Recording(
        voltages=values,
        drive=number[drive],
        measure=number[measure],
        time=frame_times(len(voltages), rate),
        reference=None if reference is None else reference[columns],
        labels=None,
        is_change=False,
        source=source,
    )


def _layout(
    arrays: Arrays, source: str, voltages: NDArray[Any]
) -> tuple[IntArray, IntArray, IntArray]:
    """Columns that hold measurements, and drive and measuring pair of each."""
    valid = np.flatnonzero(arrays["valid"].astype(bool))
    full = (
        valid,
        electrode_table(arrays, "inj", source)[valid][:, ::-1],
        electrode_table(arrays, "meas", source)[valid],
    )
    k = np.repeat(np.arange(_N), _N - 3)
    j = (k + 2 + np.tile(np.arange(_N - 3), _N)) % _N
    pair = np.column_stack([np.arange(_N), (np.arange(_N) + 1) % _N])
    packed = (np.arange(_PACKED), pair[k][:, ::-1], pair[j])
    mean = voltages.mean(axis=0)
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
        angle = _angles(numbers(arrays, "electrode_xy", source).real)
    step = 2.0 * np.pi / _N
    place = (np.pi / 2 - angle) / step
    direction = np.sign(np.sum(np.sin(np.diff(place) * step)))
    spread = place - direction * np.arange(_N)
    first = np.angle(np.mean(np.exp(1j * spread * step))) / step
    # halves round up, so that ties do not depend on the last bit
    number = (np.floor(first + 0.5 + 1e-9) + direction * np.arange(_N)) % _N
    return np.asarray(number, dtype=np.int64)


def _angles(xy: FloatArray) -> FloatArray:
    positions = xy.reshape(-1, _N, 2)[0]
    centred = positions - positions.mean(axis=0)
    return np.asarray(np.arctan2(centred[:, 1], centred[:, 0]))
