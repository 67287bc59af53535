"""A recording as MATLAB v5 with EIDORS' structures."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.io import savemat
from scipy.sparse import csc_matrix

from tomoskin.core import DataError, FloatArray, IntArray, StrPath, written
from tomoskin.sensing.signal import Recording

_LARGEST = 2**31 - 1
_STIMULATION = [("stimulation", "O"), ("stim_pattern", "O"), ("meas_pattern", "O")]


def write_matlab(
    path: StrPath,
    recording: Recording,
    current: float,
    n_electrodes: int,
    *,
    overwrite: bool = False,
) -> None:
    """Write ``stimulation`` (structure array), ``vi`` (n_meas, n_frames) V, ``time_s``, ``idle``.

    Each stimulation has ``stimulation`` "Amp", ``stim_pattern`` (n_electrodes, 1) A and
    ``meas_pattern`` (n, n_electrodes), as EIDORS' models do; rows are in EIDORS' order, drive by
    drive. The first ``idle`` frames show the untouched skin. ``vh`` is there when the recording
    has a reference, ``xy_m`` when it has labels.

    Raises
    ------
    DataError
        When the file would be larger than the format allows, and as :func:`written` does.
    """
    drives, order = _by_drive(recording.drive)
    values = _doubles(recording.voltages[:, order].T)
    if values.nbytes > _LARGEST:
        raise DataError(
            f"{values.shape[1]} frames are too many for a MATLAB v5 file (2 GiB)",
            where=str(path),
            hint="export fewer frames, or to .h5, which MATLAB also reads",
        )
    stimulation = np.empty((1, len(drives)), dtype=_STIMULATION)  # a structure array
    for number, pair in enumerate(drives):
        own = order[(recording.drive[order] == pair).all(axis=1)]
        current_in = current * _signed(pair[None], n_electrodes).T
        measured = _signed(recording.measure[own], n_electrodes)
        stimulation[0, number] = ("Amp", csc_matrix(current_in), csc_matrix(measured))
    variables: dict[str, Any] = {
        "stimulation": stimulation,
        "vi": values,
        "time_s": _doubles(recording.time[:, None]),
        "idle": float(recording.idle),  # integers divide as integers there
    }
    if recording.board_known:
        variables["board_known"] = True
    if recording.reference is not None:
        variables["vh"] = _doubles(recording.reference[order][:, None])
    if recording.labels is not None:
        variables["xy_m"] = _doubles(recording.labels)
    with written(path, overwrite=overwrite) as part:
        savemat(part, variables, do_compression=True, appendmat=False)


def _doubles(values: NDArray[Any]) -> NDArray[Any]:
    """The same as the only numbers with which MATLAB computes as everybody expects."""
    return values.astype(np.complex128 if np.iscomplexobj(values) else np.float64, copy=False)


def _by_drive(drive: IntArray) -> tuple[IntArray, IntArray]:
    """Drives in the order that they first appear, and the rows drive by drive."""
    unique, first, inverse = np.unique(drive, axis=0, return_index=True, return_inverse=True)
    order = np.argsort(first, kind="stable")
    rank = np.argsort(order, kind="stable")[inverse.reshape(-1)]
    return unique[order], np.argsort(rank, kind="stable")


def _signed(pairs: IntArray, n: int) -> FloatArray:
    """(len, n) +1 at each pair's first electrode and −1 at its second."""
    table = np.zeros((len(pairs), n))
    rows = np.arange(len(pairs))
    table[rows, pairs[:, 0]] = 1.0
    table[rows, pairs[:, 1]] = -1.0
    return table
