"""Frozen records as arrays of a file, and back, by the annotations of their fields.

A record may hold arrays, numbers, texts, tuples of texts, and further records. Its fields stand in
the file under their names, quantities with their unit; those of a record within it beside them.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import fields, is_dataclass
from inspect import Parameter, signature
from types import NoneType
from typing import Any, TypeVar, get_args, get_type_hints

import numpy as np
from numpy.typing import NDArray

from tomoskin.core import Arrays, DataError, IntArray, real_numbers, whole_number

_KEYS = {
    **{name: f"{name}_m" for name in ("xy", "outline", "unit", "slide_lag")},
    **{name: f"{name}_s" for name in ("time", "peak", "conductivity")},
    **{name: f"{name}_rad" for name in ("angle", "axis")},
    **{"area": "area_m2", "spread": "spread_m2", "skin_id": "skin"},
}
"""Names in a file of fields that have another name there: m, s or S, rad, m²."""

_FORMER = {"amount": "force_n"}
"""Names in older files, which calibrations of force had when nothing else was measured."""

T = TypeVar("T")


def pack(values: Mapping[str, Any]) -> dict[str, NDArray[Any]]:
    """Arrays of values and records by their names; those that are None are left out."""
    arrays: dict[str, NDArray[Any]] = {}
    for name, value in values.items():
        if is_dataclass(value):
            arrays |= pack({field.name: getattr(value, field.name) for field in fields(value)})
        elif value is not None:
            arrays[_KEYS.get(name, name)] = np.asarray(value)
    return arrays


def unpack(make: Callable[..., T], arrays: Arrays, **given: Any) -> T:
    """What ``make`` makes of its parameters: those ``given``, the others from the ``arrays``.

    A parameter that is a record is made by the record's ``checked``, where it has one. Raises
    DataError for a parameter without a default that the arrays lack.
    """
    hints, values = get_type_hints(make), {}
    for name, parameter in signature(make).parameters.items():
        key = _KEYS.get(name, name)
        key = _FORMER[name] if _FORMER.get(name) in arrays else key
        if name in given:
            values[name] = given[name]
        elif is_dataclass(hints[name]):
            values[name] = unpack(getattr(hints[name], "checked", hints[name]), arrays)
        elif key in arrays:
            values[name] = _value(hints[name], arrays, key)
        elif parameter.default is Parameter.empty:
            raise DataError(
                f"is not a calibration that is complete: expected {key} in the file, got "
                f"{', '.join(arrays)}"
            )
    return make(**values)


def _value(hint: Any, arrays: Arrays, key: str) -> Any:
    kinds = get_args(hint)
    plain = [kind for kind in kinds if kind is not NoneType] if NoneType in kinds else [hint]
    if plain == [str]:
        return str(arrays[key])
    if plain == [tuple[str, ...]]:
        return tuple(map(str, arrays[key].ravel().tolist()))
    if plain in ([int], [bool]):
        return plain[0](whole_number(arrays, key, ""))
    numbers = real_numbers(arrays, key, "")
    if plain == [float] and numbers.shape:
        raise DataError(f"expected one number as {key}, got shape {numbers.shape}")
    if plain == [IntArray]:
        if not (np.abs(numbers) < 1 << 53).all() or (numbers != np.round(numbers)).any():
            raise DataError(f"expected whole numbers in {key}, got others")
        return numbers.astype(np.int64)
    return float(numbers) if plain == [float] else numbers
