"""Recordings as matrices: sets of soft skins, tanks of Kuopio, arrays of pyEIT's protocol."""

from __future__ import annotations

import numpy as np

from tomoskin.core import (
    Arrays,
    DataError,
    FloatArray,
    IntArray,
    electrode_table,
    numbers,
    real_numbers,
)
from tomoskin.extras.instruments import tables
from tomoskin.files.imports import voltages_of
from tomoskin.sensing.signal import Recording

_MM = 1e-3


def is_eskin(arrays: Arrays) -> bool:
    """Whether the keys are those of such a set."""
    keys = set(arrays)
    return keys >= {"inj", "meas"} and "valid" not in keys and _kind(keys) != ""


def read_eskin(arrays: Arrays, source: str) -> Recording:
    """Sets of soft skins that name their channels by ``inj`` and ``meas``.

    ``inj`` (n_rows, 2) driven pair, ``meas`` (n_rows, 2) plus and minus of each channel; then
    ``dv`` (n, n_rows), or ``v_up`` and ``v_down`` (untouched and touched, taken as their
    difference), or ``v`` (…, n_rows). Optional ``xy_mm`` (n, 2) or (n, 1, 2), one touch a
    frame, and ``t_s`` (n,). Values are in the instrument's units.

    The current enters at the second of ``inj``: so the untouched frames of the hydrogel and
    gelatine sets have the signs of a uniform disc (correlation 0.55 to 0.65), and the reverse
    otherwise.

    Every row is kept: those that drive a pair from its other end are no copies (their changes
    correlate by 0.1 to 0.2), since the instrument does not read both signs alike.

    The recording has differences where the set holds them, else voltages.

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


_NAMES = (
    ("inj", "mpat", "U", "U_ref"),
    ("Inj", "Mpat", "Uel", "Uelref"),
    ("CurrentPattern", "MeasPattern", "Uel", "water"),
)


def is_ktc(arrays: Arrays) -> bool:
    """Whether the keys are those of the challenge."""
    return any(set(arrays) >= set(names[:3]) for names in _NAMES)


def read_ktc(arrays: Arrays, source: str) -> Recording:
    """Tanks of Kuopio: current patterns and measuring pairs as matrices.

    The 2023 challenge's own .mat files hold ``Inj`` (n_el, n_inj), ``Mpat`` (n_el, n_pairs),
    ``Uel``; collected sets hold ``inj``, ``mpat``, ``U`` (n, n_inj · n_pairs) and ``U_ref``.
    The older KIT4 tank's hold ``CurrentPattern``, ``MeasPattern``, ``Uel`` (n_pairs, n_inj),
    one or several, and ``water``. Values run injection by injection. Electrode 1 is at the top;
    the challenge counts counter-clockwise, KIT4 clockwise (both fitted to the targets, not from
    the authors). The recording counts clockwise, as built-in skins do. The injected currents
    differ by some per cent; the voltages are left as they are.

    The water's voltages are the reference where they are there.

    Raises
    ------
    DataError
        When the shapes do not belong together or a pattern is no pair.
    """
    inj, mpat, voltages, reference = next(n for n in _NAMES if set(arrays) >= set(n[:3]))
    injections = tables.drives_of(real_numbers(arrays, inj, source).T, "injection", source)
    pairs = tables.pairs_of(real_numbers(arrays, mpat, source).T, "measuring pair", source)
    n_electrodes = arrays[inj].shape[0]
    n_rows = len(injections) * len(pairs)
    values = _flat(real_numbers(arrays, voltages, source), len(injections), len(pairs))
    if not values.size or values.size % n_rows:
        raise DataError(
            f"expected {voltages} of (n, {n_rows}), got {arrays[voltages].shape}", where=source
        )
    frames = values.reshape(-1, n_rows)
    water = None
    if reference in arrays:
        water = _flat(real_numbers(arrays, reference, source), len(injections), len(pairs))
        if len(water) != n_rows:
            raise DataError(f"expected {reference} ({n_rows},), got {len(water)}", where=source)
    rows = np.repeat(injections, len(pairs), axis=0), np.tile(pairs, (len(injections), 1))
    if inj != "CurrentPattern":
        turned = tables.clockwise(rows[0], n_electrodes)
        if rows[0].shape[1] > 2:
            turned = rows[0][:, tables.clockwise(np.arange(n_electrodes), n_electrodes)]
        rows = turned, tables.clockwise(rows[1], n_electrodes)
    return voltages_of(source, frames, rows, reference=water).without_repeats()


def _flat(values: FloatArray, n_injections: int, n_pairs: int) -> FloatArray:
    """Values one after another, injection by injection."""
    if values.ndim > 1 and values.shape[-2:] == (n_pairs, n_injections) and n_pairs > 1:
        values = np.swapaxes(values, -2, -1)
    return values.reshape(-1)


def is_pyeit(arrays: Arrays) -> bool:
    """Whether the keys are those of pyEIT's protocol with voltages."""
    return "ex_mat" in arrays and bool({"v", "v1"} & set(arrays))


def read_pyeit(arrays: Arrays, source: str) -> Recording:
    """Arrays of pyEIT's protocol: ``ex_mat`` (n_exc, 2) current in, out; ``meas_mat`` (n_exc,
    n, 2).

    A voltage is φ[meas_mat[…, 0]] − φ[meas_mat[…, 1]]; values run excitation by excitation in
    ``v`` (n_frames, n_exc · n), or ``v1`` with the reference ``v0``. Without ``meas_mat`` it is
    pyEIT's standard one: pairs j + 1, j from j = 0 on, those at a driven electrode left out.
    Electrodes keep their numbers: pyEIT's own circle begins at −x and counts clockwise.

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
        pairs = tables.neighbours(1 + int(excitations.max()))
        return tables.scan_of(excitations, pairs[:, ::-1])[0]
    table = real_numbers(arrays, "meas_mat", source)
    if table.ndim != 3 or table.shape[0] != len(excitations) or table.shape[2] != 2:
        raise DataError(
            f"expected meas_mat ({len(excitations)}, n, 2), got {table.shape}", where=source
        )
    measure = electrode_table({"meas_mat": table.reshape(-1, 2)}, "meas_mat", source)
    return np.repeat(excitations, table.shape[1], axis=0), measure
