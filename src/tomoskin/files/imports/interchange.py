"""The interchange file: a plain .npz that any tool can write.

Keys: ``voltages`` (n_frames, n_meas) V, or ``dv``; ``drive`` (n_meas, 2) source, sink, or
(n_meas, n_electrodes) currents into many electrodes; ``measure`` (n_meas, 2) plus, minus; optional
``time_s`` (n_frames,), ``reference`` (n_meas,), ``xy_m`` (n_frames, 2), ``idle`` frames at the
beginning that show the untouched skin; ``board_known`` where the skin's own read-out recorded the
frames.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tomoskin.core import (
    Arrays,
    DataError,
    StrPath,
    electrode_table,
    numbers,
    real_numbers,
    save_arrays,
    whole_number,
)
from tomoskin.files.imports.tables import checked_currents, voltages_of
from tomoskin.sensing.signal import Recording

OWN = "board_known"
"""Key of a file whose noise the skin's own read-out predicts: the export of a session."""

REQUIRED = frozenset({"drive", "measure"})


def detects(arrays: Arrays) -> bool:
    """Whether the keys are those of an interchange file."""
    return set(arrays) >= REQUIRED and len({"voltages", "dv"} & set(arrays)) > 0


def parse(arrays: Arrays, source: str) -> Recording:
    """Return the recording in the arrays of an interchange file.

    Raises
    ------
    DataError
        When both or neither of voltages and dv are there, a key has the wrong type or shape.
    """
    if "voltages" in arrays and "dv" in arrays:
        raise DataError("holds both voltages and dv", where=source, hint="keep one of them")
    key = "voltages" if "voltages" in arrays else "dv"
    drive, measure = _drives(arrays, source), electrode_table(arrays, "measure", source)
    recording = voltages_of(
        source,
        np.atleast_2d(numbers(arrays, key, source)),
        (drive, measure),
        time=real_numbers(arrays, "time_s", source) if "time_s" in arrays else None,
        reference=numbers(arrays, "reference", source) if "reference" in arrays else None,
        labels=real_numbers(arrays, "xy_m", source) if "xy_m" in arrays else None,
        is_change=key == "dv",
    )
    idle = whole_number(arrays, "idle", source) if "idle" in arrays else 1
    return replace(recording, idle=idle, board_known=OWN in arrays)


def _drives(arrays: Arrays, source: str) -> NDArray[Any]:
    """(n_meas, 2) source and sink, or (n_meas, n_electrodes) currents."""
    table = real_numbers(arrays, "drive", source)
    if table.ndim != 2 or table.shape[1] <= 2 or len(table) != len(arrays["measure"]):
        return electrode_table(arrays, "drive", source)
    checked_currents(table, "drive row", source)
    return table


def write_interchange(path: StrPath, recording: Recording, *, overwrite: bool = False) -> None:
    """Write ``recording`` as an interchange file; raises as :func:`written` does."""
    arrays: dict[str, NDArray[Any]] = {
        "dv" if recording.is_change else "voltages": recording.voltages,
        "drive": recording.drive,
        "measure": recording.measure,
        "idle": np.array(recording.idle),
    }
    if recording.timed:
        arrays["time_s"] = recording.time
    if recording.reference is not None:
        arrays["reference"] = recording.reference
    if recording.labels is not None:
        arrays["xy_m"] = recording.labels
    if recording.board_known:
        arrays[OWN] = np.array(True)
    save_arrays(path, arrays, overwrite=overwrite)
