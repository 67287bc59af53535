"""Arrays of a file, checked: numbers, whole numbers, tables of electrodes."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from tomoskin.core.archive import Arrays
from tomoskin.core.errors import DataError
from tomoskin.core.records import FloatArray, IntArray

MOST_ELECTRODES = 1024
"""More are taken for damage of a file."""


def numbers(arrays: Arrays, key: str, source: str) -> NDArray[Any]:
    """Array ``key`` as float64, or complex128 where it is complex."""
    array = arrays[key]
    if array.dtype.kind not in "biufc":
        raise DataError(f"expected numbers in {key}, got {array.dtype}", where=source)
    return array.astype(np.complex128 if array.dtype.kind == "c" else np.float64, copy=False)


def real_numbers(arrays: Arrays, key: str, source: str) -> FloatArray:
    """Array ``key`` as float64 numbers."""
    array = numbers(arrays, key, source)
    if array.dtype.kind == "c":
        raise DataError(f"expected real numbers in {key}, got complex ones", where=source)
    return array


def whole_number(arrays: Arrays, key: str, where: str, most: int = 1 << 31) -> int:
    """Array ``key`` as one whole number, at most ``most``."""
    value = real_numbers(arrays, key, where)
    if value.shape or value != np.round(value) or not abs(value) <= most:
        got = f"shape {value.shape}" if value.shape else f"{value:g}"
        raise DataError(f"expected one whole number up to {most} as {key}, got {got}", where=where)
    return int(value)


def electrode_table(arrays: Arrays, key: str, source: str) -> IntArray:
    """Array ``key`` as an (n, 2) table of electrodes from 0."""
    table = real_numbers(arrays, key, source)
    if table.ndim != 2 or table.shape[1] != 2:
        raise DataError(f"expected {key} of shape (n_meas, 2), got {table.shape}", where=source)
    good = (table >= 0) & (table < MOST_ELECTRODES) & (table == np.round(table))
    if not good.all():
        row = int(np.argmin(good.all(axis=1)))
        raise DataError(
            f"expected whole electrode numbers from 0 (E1), got {table[row].tolist()}",
            where=f"{source}, {key} row {row}",
        )
    return table.astype(np.int64)
