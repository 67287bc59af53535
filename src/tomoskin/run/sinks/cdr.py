"""ROS 2 messages as bytes: plain CDR, little-endian."""

from __future__ import annotations

import struct
from collections.abc import Mapping
from typing import Any

import numpy as np

from tomoskin.run.sinks.ros_types import TYPES, Field

_LAYOUTS = {
    "uint8": "B", "byte": "B", "bool": "?", "int32": "i", "uint32": "I", "float32": "f",
    "float64": "d",
}  # fmt: skip
_HEADER = b"\x00\x01\x00\x00"


def encode_cdr(kind: str, value: Mapping[str, Any]) -> bytes:
    """The message ``kind`` with those fields, by name; arrays of numbers are numpy's or bytes."""
    out = bytearray()
    _put_message(out, kind, value)
    return _HEADER + bytes(out)


def _put_message(out: bytearray, kind: str, value: Mapping[str, Any]) -> None:
    for name, text in TYPES[kind].items():
        field = Field.of(text)
        if field.length is None:
            _put(out, field.kind, value[name])
        else:
            _put_array(out, field, value[name])


def _put(out: bytearray, kind: str, value: Any) -> None:
    if kind in TYPES:
        _put_message(out, kind, value)
    elif kind == "string":
        data = value.encode() + b"\0"
        _put_number(out, "I", len(data))
        out += data
    else:
        _put_number(out, _LAYOUTS[kind], value)


def _put_array(out: bytearray, field: Field, value: Any) -> None:
    if not field.length:
        _put_number(out, "I", len(value))
    layout = _LAYOUTS.get(field.kind)
    if layout is None:
        for item in value:
            _put(out, field.kind, item)
    elif len(value):
        _align(out, layout)
        out += value if isinstance(value, bytes) else np.asarray(value, f"<{layout}").tobytes()


def _put_number(out: bytearray, layout: str, value: float) -> None:
    _align(out, layout)
    out += struct.pack("<" + layout, value)


def _align(out: bytearray, layout: str) -> None:
    out += bytes(-len(out) % struct.calcsize("<" + layout))
