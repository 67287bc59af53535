"""Types of ROS 2 messages (``ros_types.msg``): fields, names, definitions, hashes; their bytes."""

from __future__ import annotations

import functools
import re
import struct
from collections.abc import Mapping
from dataclasses import dataclass
from importlib.resources import files
from typing import Any

import numpy as np

_LAYOUTS = {
    "uint8": "B", "byte": "B", "bool": "?", "int32": "i", "uint32": "I", "int64": "q",
    "uint64": "Q", "float32": "f", "float64": "d",
}  # fmt: skip
_CDR = b"\x00\x01\x00\x00"


_HASH = "# "
"""What stands before a type's hash, behind its name."""


def _text(file: str) -> str:
    return (files(__package__) / file).read_text(encoding="utf-8")


def _read_types(file: str) -> dict[str, dict[str, str]]:
    types = {}
    for block in _text(file).strip().split("\n\n"):
        title, *lines = re.sub("/(?!srv/|[A-Z][a-zA-Z]+_)", "/msg/", block).splitlines()
        fields = [line.split() for line in lines if not line.startswith(_HASH)]
        types[title.removeprefix("MSG: ")] = {name: kind for kind, name in fields}
    return types


TYPES = _read_types("ros_types.msg")
"""Fields of each message by name, in order: a number, ``string``, another message, or an array."""

_IN_ORDER: list[str] = re.findall(f"{_HASH}(.+)", _text("ros_types.msg"))
_HASHES = dict(zip(TYPES, _IN_ORDER, strict=True))

NODE_TYPES = TYPES | _read_types("ros_node.msg")
"""The same with what the services of a node take and give, as ``rmw_cyclonedds`` sends it."""


@dataclass(frozen=True)
class Field:
    """``kind`` without its brackets; ``length`` of an array: 0 for any, None where it is none."""

    kind: str
    length: int | None

    @staticmethod
    @functools.cache
    def of(text: str) -> Field:
        """The field that a message's table writes as ``text``."""
        kind, bracket, length = text.rstrip("]").partition("[")
        return Field(kind, int(length or 0) if bracket else None)


def type_hash(kind: str) -> str:
    """RIHS01 hash of a message's type, as ROS 2 has it from Iron on."""
    return _HASHES[kind]


def dds_name(kind: str) -> str:
    """Name of a message's type on the wire: ``std_msgs::msg::dds_::String_``."""
    package, _, name = kind.rpartition("/")
    return f"{package.replace('/', '::')}::dds_::{name}_"


def definition(kind: str) -> list[str]:
    """The text of a message's definition, then that of each message in it, headed by its name."""
    inner = (f"MSG: {_short(name)}\n{_fields(name)}" for name in sorted(_used_by(kind)))
    return [_fields(kind), *inner]


def encode_cdr(kind: str, value: Mapping[str, Any]) -> bytes:
    """The message ``kind`` with those fields as plain CDR, little-endian.

    Arrays of numbers are numpy's or bytes. A field that is not there is zero, or empty.
    """
    out = bytearray()
    _put_message(out, kind, value)
    return _CDR + bytes(out)


def _fields(kind: str) -> str:
    return "\n".join(f"{_short(text)} {name}" for name, text in TYPES[kind].items())


def _short(kind: str) -> str:
    """As definitions name it: without "msg"."""
    return kind.replace("/msg/", "/")


def _used_by(kind: str) -> set[str]:
    direct = {Field.of(text).kind for text in TYPES[kind].values()} & TYPES.keys()
    return direct.union(*(_used_by(name) for name in direct))


def _put_message(out: bytearray, kind: str, value: Mapping[str, Any]) -> None:
    for name, text in NODE_TYPES[kind].items():
        field = Field.of(text)
        given = value.get(name, _absent(field))
        if field.length is None:
            _put(out, field.kind, given)
        else:
            _put_array(out, field, given)


def _absent(field: Field) -> Any:
    """What stands for a field that is not given."""
    if field.length is not None:
        return field.length * (0,)
    return {} if field.kind in NODE_TYPES else "" if field.kind == "string" else 0


def _put(out: bytearray, kind: str, value: Any) -> None:
    if kind in NODE_TYPES:
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
