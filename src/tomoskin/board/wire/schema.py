"""The schema: ``protocol.toml`` read into records, and its hash."""

from __future__ import annotations

import hashlib
import json
import re
import struct
import tomllib
from importlib.resources import files
from typing import Any, Literal, Self

import msgspec

SCALARS = {"u8": "B", "u16": "H", "u32": "I", "u64": "Q"}
"""Scalar types of the schema and their codes for :mod:`struct`."""


class FieldSpec(msgspec.Struct, frozen=True, rename={"type_name": "type"}):
    """One field; its type is written ``u16``, ``u8[8]`` or ``drive[]``."""

    name: str
    type_name: str
    text: str
    enum: str = ""
    unit: str = ""

    @property
    def item(self) -> str:
        """The type without its length."""
        return self.type_name.partition("[")[0]

    @property
    def length(self) -> int:
        """1 for a scalar, n for a fixed array, 0 for one that fills the payload."""
        array = re.search(r"\[(\d*)\]$", self.type_name)
        return int(array[1] or 0) if array else 1

    @property
    def size(self) -> int:
        """Bytes that it takes; 0 where it fills the payload."""
        return struct.calcsize("<" + SCALARS[self.item]) * self.length if self.length else 0


class EnumValue(msgspec.Struct, frozen=True):
    """A value of an enumeration, with a sentence for a person to read."""

    name: str
    value: int
    text: str


class EnumSpec(msgspec.Struct, frozen=True):
    """An enumeration of the schema with its values."""

    text: str
    values: tuple[EnumValue, ...]

    def sentence(self, value: int) -> str:
        """The sentence for a value, for a person to read."""
        return next((one.text for one in self.values if one.value == value), f"code {value}")


class StructSpec(msgspec.Struct, frozen=True):
    """A group of fields that repeats."""

    text: str
    fields: tuple[FieldSpec, ...]


class MessageSpec(msgspec.Struct, frozen=True):
    """A message: its type byte, direction and fields."""

    name: str
    type: int
    direction: Literal["to_device", "from_device"]
    text: str
    fields: tuple[FieldSpec, ...]

    @property
    def to_device(self) -> bool:
        """Whether the host sends it to the board."""
        return self.direction == "to_device"


_LIMITS = {"to_device_bytes": "to_device", "from_device_bytes": "from_device"}


class Schema(msgspec.Struct, frozen=True, rename=_LIMITS):
    """Everything that board and host must agree on.

    Boards and hosts of another ``major`` version do not understand each other; a host understands
    boards of its own and of older ``minor`` versions. The bytes are the largest payload and
    checksum together, by direction; ``hash`` is a u32 over everything but the sentences, which
    board and host compare.
    """

    major: int
    minor: int
    to_device_bytes: int
    from_device_bytes: int
    enums: dict[str, EnumSpec]
    structs: dict[str, StructSpec]
    messages: tuple[MessageSpec, ...]
    hash: int

    @classmethod
    def read(cls, text: str) -> Self:
        """Read the text of a schema file."""
        raw = tomllib.loads(text)
        return msgspec.convert(raw | raw["protocol"] | raw["limits"] | {"hash": _hash(raw)}, cls)


def _hash(raw: dict[str, Any]) -> int:
    canonical = json.dumps(_without_text(raw), sort_keys=True, separators=(",", ":"))
    return int.from_bytes(hashlib.sha256(canonical.encode()).digest()[:4], "little")


def _without_text(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _without_text(item) for key, item in value.items() if key != "text"}
    return [_without_text(item) for item in value] if isinstance(value, list) else value


SCHEMA = Schema.read(
    files("tomoskin.board.wire").joinpath("protocol.toml").read_text(encoding="utf-8")
)
"""The schema that this host was made with."""

OLDER = {(1, 0): 0x8B6ABBBD, (1, 1): 0xF17AB758, (1, 2): 0x6B98E2FE, (1, 3): 0xFFDB1F25}
"""Hashes of the published versions, by major and minor, that this host speaks besides its own."""
