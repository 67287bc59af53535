"""Sets of soft skins that name their channels by ``inj`` and ``meas``.

``inj`` (n_rows, 2) driven pair, ``meas`` (n_rows, 2) plus and minus of each channel; then ``dv``
(n, n_rows), or ``v_up`` and ``v_down`` (untouched and touched, taken as their difference), or
``v`` (…, n_rows). Optional ``xy_mm`` (n, 2) or (n, 1, 2), one touch a frame, and ``t_s`` (n,).
Values are in the instrument's units.

The current enters at the second of ``inj``: so the untouched frames of the hydrogel and gelatine
sets have the signs of a uniform disc (correlation 0.55 to 0.65), and the reverse otherwise.

Every row is kept: those that drive a pair from its other end are no copies (their changes correlate
by 0.1 to 0.2), since the instrument does not read both signs alike.
"""

from __future__ import annotations

import numpy as np

from tomoskin.core import Arrays, DataError, FloatArray, electrode_table, real_numbers
from tomoskin.files.imports.tables import voltages_of
from tomoskin.sensing.signal import Recording

_MM = 1e-3


def detects(arrays: Arrays) -> bool:
    """Whether the keys are those of such a set."""
    keys = set(arrays)
    return keys >= {"inj", "meas"} and "valid" not in keys and _kind(keys) != ""


def parse(arrays: Arrays, source: str) -> Recording:
    """Return the recording: differences where the set holds them, else voltages.

    Raises
    ------
    DataError
        When an array has the wrong shape or type.
    """
    kind = _kind(set(arrays))
    n_rows = len(electrode_table(arrays, "inj", source))
    if kind == "v_up":
        up, down = (_frames(arrays, key, n_rows, source) for key in ("v_up", "v_down"))
        if up.shape != down.shape:
            raise DataError(f"expected v_down as v_up {up.shape}, got {down.shape}", where=source)
        values = down - up
    else:
        values = _frames(arrays, kind, n_rows, source)
    inj, meas = (electrode_table(arrays, key, source) for key in ("inj", "meas"))
    return voltages_of(
        source,
        values,
        (inj[:, ::-1], meas),
        time=real_numbers(arrays, "t_s", source) if "t_s" in arrays else None,
        labels=_labels(arrays, len(values), source),
        is_change=kind != "v",
    )


def _kind(keys: set[str]) -> str:
    """Which arrays hold the frames."""
    if "dv" in keys:
        return "dv"
    if keys >= {"v_up", "v_down"}:
        return "v_up"
    return "v" if "v" in keys else ""


def _frames(arrays: Arrays, key: str, n_rows: int, source: str) -> FloatArray:
    values = real_numbers(arrays, key, source)
    if not values.ndim or values.shape[-1] != n_rows:
        raise DataError(f"expected {key} (…, {n_rows}), got {values.shape}", where=source)
    return values.reshape(-1, n_rows)


def _labels(arrays: Arrays, n: int, source: str) -> FloatArray | None:
    """(n, 2) m; None for sets of several fingers."""
    if "xy_mm" not in arrays:
        return None
    xy = real_numbers(arrays, "xy_mm", source)
    if xy.ndim == 3 and xy.shape[1] > 1:
        return None
    positions = xy.reshape(-1, 2) if xy.size % 2 == 0 else xy
    repeats, rest = divmod(n, max(len(positions), 1))
    if rest or not repeats:
        raise DataError(f"expected xy_mm ({n}, 2), got {xy.shape}", where=source)
    return np.asarray(_MM * np.repeat(positions, repeats, axis=0))
