"""Arrays of pyEIT's protocol: ``ex_mat`` (n_exc, 2) current in, out; ``meas_mat`` (n_exc, n, 2).

A voltage is φ[meas_mat[…, 0]] − φ[meas_mat[…, 1]]; values run excitation by excitation in ``v``
(n_frames, n_exc · n), or ``v1`` with the reference ``v0``. Without ``meas_mat`` it is pyEIT's
standard one: pairs j + 1, j from j = 0 on, those at a driven electrode left out. Electrodes keep
their numbers: pyEIT's own circle begins at −x and counts clockwise.
"""

from __future__ import annotations

import numpy as np

from tomoskin.core import Arrays, DataError, IntArray, electrode_table, numbers, real_numbers
from tomoskin.files.imports.tables import neighbours, scan_of, voltages_of
from tomoskin.sensing.signal import Recording


def detects(arrays: Arrays) -> bool:
    """Whether the keys are those of pyEIT's protocol with voltages."""
    return "ex_mat" in arrays and bool({"v", "v1"} & set(arrays))


def parse(arrays: Arrays, source: str) -> Recording:
    """Return the recording.

    Raises
    ------
    DataError
        When the shapes do not belong together.
    """
    rows = _rows(arrays, source)
    count = len(rows[0])
    voltages = np.atleast_2d(numbers(arrays, "v" if "v" in arrays else "v1", source))
    reference = numbers(arrays, "v0", source).reshape(-1) if "v0" in arrays else None
    if voltages.shape[-1] != count:
        raise DataError(
            f"expected v (n_frames, {count}), got {voltages.shape}: its protocol has {count} rows",
            where=source,
        )
    return voltages_of(source, voltages, rows, reference=reference)


def _rows(arrays: Arrays, source: str) -> tuple[IntArray, IntArray]:
    excitations = electrode_table(arrays, "ex_mat", source)
    if "meas_mat" not in arrays:
        pairs = neighbours(1 + int(excitations.max()))
        return scan_of(excitations, pairs[:, ::-1])[0]
    table = real_numbers(arrays, "meas_mat", source)
    if table.ndim != 3 or table.shape[0] != len(excitations) or table.shape[2] != 2:
        raise DataError(
            f"expected meas_mat ({len(excitations)}, n, 2), got {table.shape}", where=source
        )
    measure = electrode_table({"meas_mat": table.reshape(-1, 2)}, "meas_mat", source)
    return np.repeat(excitations, table.shape[1], axis=0), measure
