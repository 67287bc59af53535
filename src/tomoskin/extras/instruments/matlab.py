"""MATLAB files (v5 to v7) as plain arrays and structures, refused where they would not end; EIDORS'
structures in them."""

from __future__ import annotations

import math
import struct
import zlib
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.io import loadmat, whosmat
from scipy.io.matlab import MatlabObject, MatlabOpaque
from scipy.sparse import issparse

from tomoskin.core import Arrays, DataError, FloatArray, IntArray, check_fits, numeric
from tomoskin.extras.instruments.tables import drives_of, pairs_of
from tomoskin.files.imports import BOARD_KNOWN, voltages_of
from tomoskin.sensing.signal import Recording

_HEAD = 128
_COMPRESSED = 15
_BLOCK = 1 << 20
_NUMBER = 8
_HOLDERS = ("struct", "cell", "object", "opaque", "function", "sparse")
"""What holds variables of its own: it is measured by what it unpacks to."""


def is_matlab(beginning: bytes) -> bool:
    """Whether a file begins as MATLAB's do."""
    return beginning.startswith(b"MATLAB ")


def load_matlab(path: Path) -> dict[str, Any]:
    """Variables by name; structures are dicts, arrays of them lists of dicts.

    Raises
    ------
    DataError
        When the file is of v7.3, damaged, or would be too large in memory.
    """
    where = str(path)
    try:
        _check_size(path)
        variables = loadmat(path, simplify_cells=True)
    except NotImplementedError as error:
        raise DataError(
            "is a MATLAB file of version 7.3", where=where, hint="save it with -v7"
        ) from error
    except DataError:
        raise
    except MemoryError as error:
        raise DataError("is too large for the memory of this machine", where=where) from error
    except Exception as error:
        # scipy raises whatever its parser meets in a damaged file
        raise DataError(f"is damaged, or not a MATLAB file: {error}", where=where) from error
    return {key: value for key, value in variables.items() if not key.startswith("__")}


def _check_size(path: Path) -> None:
    """Unpack every compressed variable a block at a time, keeping none of it.

    What a number takes in memory is more than in the file, where small ones stand as bytes.
    """
    shapes = [shape for _, shape, kind in whosmat(path) if kind not in _HOLDERS]
    check_fits(sum(_NUMBER * math.prod(shape) for shape in shapes), str(path))
    total = 0
    with path.open("rb") as file:
        file.seek(_HEAD - 2)
        order = "<" if file.read(2) == b"IM" else ">"
        while len(head := file.read(8)) == 8:
            kind, size = struct.unpack(f"{order}II", head)
            if kind != _COMPRESSED:
                total += size
                file.seek(size, 1)
            else:
                total = _unpacked(file.read(size), total, str(path))
            check_fits(total, str(path))


def _unpacked(data: bytes, total: int, where: str) -> int:
    unpack = zlib.decompressobj()
    while data:
        total += len(unpack.decompress(data, _BLOCK))
        check_fits(total, where)
        data = unpack.unconsumed_tail
    return total


_DATA = ("vi", "vv", "v", "data", "meas")
_REFERENCE = ("vh", "reference")


def is_eidors(variables: Mapping[str, Any]) -> bool:
    """Whether there is a stimulation structure, or the same as matrices."""
    return _model(variables) is not None or set(variables) >= {"stim", "meas", "meas_stim"}


def read_eidors(variables: Mapping[str, Any], source: str) -> Recording:
    """EIDORS' structures: a ``stimulation`` array with ``stim_pattern`` and ``meas_pattern``.

    They stand alone or in a model (``fmdl``, ``img.fwd_model``, …). Each has the current into every
    electrode (n_el, 1) and one row of ±1 a measurement (n, n_el). Data are columns, one a frame:
    ``vi``, ``vv``, ``v``, ``data`` or ``meas`` (or a structure with ``meas``), with ``vh`` as the
    reference; full scans are thinned by ``meas_select``, of the model or beside it. The same as
    plain matrices: ``stim`` (n_drives, n_el), ``meas`` (n_meas, n_el), ``meas_stim`` (n_meas, 1)
    from 1. Electrodes keep their numbers: EIDORS' own circles begin at the top and count
    clockwise, as built-in skins do.

    Raises
    ------
    DataError
        When a pattern is not one electrode against one other, there are no data, or their
        number of rows is another.
    """
    model = _model(variables)
    if model is None:
        drive, measure = _flat_rows(variables, source)
        names = tuple(name for name in _DATA if name != "meas")
    else:
        drive, measure = _rows(_listed(model) or [], source)
        names = _DATA
    select = _selected(model or {}, variables, source)
    is_full = select is not None and len(select) == len(drive)
    if is_full and _read(variables, names, None, len(drive), source) is None:
        drive, measure = drive[select], measure[select]  # the data are thinned already
    voltages = _read(variables, names, select, len(drive), source)
    if voltages is None:
        raise DataError(
            f"expected data of {len(drive)} rows among {', '.join(names)}, got the variables "
            f"{', '.join(sorted(variables))}",
            where=source,
        )
    reference = _read(variables, _REFERENCE, select, len(drive), source)
    idle = _numbers(variables, "idle", ())
    recording = voltages_of(
        source,
        voltages,
        (drive, measure),
        time=_numbers(variables, "time_s", (len(voltages),)),
        reference=None if reference is None else reference[0],
        labels=_numbers(variables, "xy_m", (len(voltages), 2)),
    )
    return replace(
        recording,
        idle=int(idle) if idle is not None and idle in range(1, len(voltages) + 1) else 1,
        board_known=BOARD_KNOWN in variables,
    )


def _model(variables: Any) -> Mapping[str, Any] | None:
    """What holds the first stimulation structure: the variables, or a model among them."""
    if not isinstance(variables, Mapping):
        return None
    if _listed(variables) is not None:
        return variables
    inner = (_model(value) for value in variables.values())
    return next((item for item in inner if item is not None), None)


def _listed(model: Mapping[str, Any]) -> list[Mapping[str, Any]] | None:
    """Its stimulations; None where it has none."""
    for key in ("stimulation", "stim"):
        names = model.get(key)
        listed = [names] if isinstance(names, Mapping) else names
        if isinstance(listed, list | np.ndarray) and len(listed):
            items = [item for item in listed if isinstance(item, Mapping)]
            if len(items) == len(listed) and all("stim_pattern" in item for item in items):
                return items
    return None


def _selected(
    model: Mapping[str, Any], variables: Mapping[str, Any], source: str
) -> NDArray[np.bool_] | None:
    """(n,) which rows of a full scan count; None where nothing says it."""
    for holder in (model, variables):
        if (given := holder.get("meas_select")) is not None:
            select = _dense(given, source).reshape(-1) != 0
            if len(select) > 1:
                return np.asarray(select)
    return None


def _rows(stimulation: list[Mapping[str, Any]], source: str) -> tuple[NDArray[Any], IntArray]:
    currents, measures = [], []
    for number, item in enumerate(stimulation, start=1):
        where = f"{source}, stimulation {number}"
        current = _dense(item["stim_pattern"], where).reshape(1, -1)
        patterns = np.atleast_2d(_dense(item.get("meas_pattern"), where))
        measures.append(pairs_of(patterns, "measurement", where))
        currents.append(np.repeat(current, len(patterns), axis=0))
    drive = drives_of(np.concatenate(currents), "drive of row", source)
    return drive, np.concatenate(measures)


def _flat_rows(variables: Mapping[str, Any], source: str) -> tuple[NDArray[Any], IntArray]:
    drives = drives_of(np.atleast_2d(_dense(variables["stim"], source)), "drive", source)
    measure = pairs_of(np.atleast_2d(_dense(variables["meas"], source)), "measurement", source)
    index = _dense(variables["meas_stim"], source).reshape(-1)
    is_number = (index == np.round(index)) & (index >= 1) & (index <= len(drives))
    if len(index) != len(measure) or not is_number.all():
        raise DataError(
            f"expected meas_stim of {len(measure)} drives from 1 to {len(drives)}, "
            f"got {len(index)} values, not all of them such drives",
            where=source,
        )
    return drives[index.astype(int) - 1], measure


def _read(
    variables: Mapping[str, Any],
    names: tuple[str, ...],
    select: NDArray[np.bool_] | None,
    n_rows: int,
    source: str,
) -> NDArray[Any] | None:
    """(n_frames, n_rows) of the first of ``names`` that has so many rows."""
    for name in names:
        value = variables.get(name)
        if isinstance(value, Mapping):
            value = value.get("meas")
        if value is None or isinstance(value, str | list):
            continue
        data = _dense(value, source)
        data = data.reshape(-1, 1) if data.ndim == 1 else data
        if data.ndim == 2 and select is not None and len(data) == len(select) != n_rows:
            data = data[select]
        if data.ndim == 2 and len(data) == n_rows:
            return np.ascontiguousarray(data.T)
    return None


def _numbers(variables: Mapping[str, Any], name: str, shape: tuple[int, ...]) -> FloatArray | None:
    """What our own export has beside; None where it is something else."""
    names = np.asarray(variables.get(name))
    if names.size != math.prod(shape) or names.dtype.kind not in "iuf":
        return None
    return names.reshape(shape).astype(np.float64)


def _dense(value: Any, where: str) -> NDArray[Any]:
    sparse: Any = value
    array = numeric(sparse.toarray() if issparse(value) else value, DataError, where=where)
    return array.astype(np.complex128 if array.dtype.kind == "c" else np.float64, copy=False)


def read_matlab(path: Path, source: str) -> Recording | Arrays:
    """The recording in EIDORS' structures, or else the file's arrays of numbers by name.

    Raises
    ------
    DataError
        As :func:`load_matlab` and :func:`read_eidors` do, and for objects of MATLAB's.
    """
    variables = load_matlab(path)
    if is_eidors(variables):
        return read_eidors(variables, source)
    if objects := [k for k, v in variables.items() if isinstance(v, MatlabObject | MatlabOpaque)]:
        raise DataError(
            f"holds MATLAB objects ({', '.join(objects)}), which only MATLAB can read",
            where=source,
            hint='in MATLAB: s = struct(object); save("plain.mat", "-struct", "s", "-v7")',
        )
    arrays = {
        key: value
        for key, value in variables.items()
        if isinstance(value, np.ndarray) and value.dtype.kind in "biufc"
    }
    if variables and not arrays:
        raise DataError(
            "expected EIDORS' stimulation with its data, or arrays of numbers, got "
            + ", ".join(f"{name} ({_what(value)})" for name, value in sorted(variables.items())),
            where=source,
            hint="docs/interchange.md lists what can be read",
        )
    return arrays


def _what(value: Any) -> str:
    if isinstance(value, Mapping):
        return f"a structure of {', '.join(map(str, value))}" if value else "a structure"
    if isinstance(value, list | np.ndarray):
        return "cells or structures"
    return "text" if isinstance(value, str) else type(value).__name__
