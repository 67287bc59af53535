"""The schema: ``protocol.toml`` read into records, and its hash."""

from __future__ import annotations

import hashlib
import json
import re
import struct
import tomllib
from dataclasses import dataclass
from functools import cached_property
from importlib.resources import files
from typing import Any, Self

from tomoskin.core import WireError

SCALARS = {"u8": "B", "u16": "H", "u32": "I", "u64": "Q"}
"""Scalar types of the schema and their codes for :mod:`struct`."""

_TYPE = re.compile(r"^(?P<item>\w+?)(?P<array>\[(?P<length>\d*)\])?$")


@dataclass(frozen=True)
class FieldSpec:
    """One field: ``item`` type; ``length`` 1 a scalar, n a fixed array, 0 fills the payload."""

    name: str
    item: str
    length: int
    enum: str
    unit: str
    text: str

    @property
    def is_tail(self) -> bool:
        """Whether the field fills the rest of the payload."""
        return self.length == 0

    @property
    def type_name(self) -> str:
        """As the schema writes it: ``u16``, ``u8[8]`` or ``drive[]``."""
        return self.item + {0: "[]", 1: ""}.get(self.length, f"[{self.length}]")

    @property
    def size(self) -> int:
        """Bytes that it takes; 0 where it fills the payload."""
        return struct.calcsize("<" + SCALARS[self.item]) * self.length if self.length else 0

    @classmethod
    def read(cls, raw: dict[str, Any]) -> Self:
        """From a table of the file."""
        parts = _TYPE.match(raw["type"])
        if parts is None:
            raise WireError(f'expected a type such as u16, u8[8] or u16[], got "{raw["type"]}"')
        length = 1 if parts["array"] is None else int(parts["length"] or 0)
        return cls(
            raw["name"], parts["item"], length, raw.get("enum", ""), raw.get("unit", ""),
            raw["text"],
        )  # fmt: skip


@dataclass(frozen=True)
class EnumSpec:
    """Names, values and sentences of an enumeration."""

    name: str
    text: str
    values: tuple[tuple[str, int, str], ...]

    def sentence(self, value: int) -> str:
        """The sentence for a value, for a person to read."""
        return next((text for _, number, text in self.values if number == value), f"code {value}")


@dataclass(frozen=True)
class StructSpec:
    """A group of fields that repeats."""

    name: str
    text: str
    fields: tuple[FieldSpec, ...]


@dataclass(frozen=True)
class MessageSpec:
    """A message: its type byte, direction and fields."""

    name: str
    type: int
    to_device: bool
    text: str
    fields: tuple[FieldSpec, ...]


@dataclass(frozen=True)
class Schema:
    """Everything that board and host must agree on."""

    name: str
    major: int
    minor: int
    to_device_bytes: int
    from_device_bytes: int
    enums: dict[str, EnumSpec]
    structs: dict[str, StructSpec]
    messages: tuple[MessageSpec, ...]
    hash: int
    """u32 over everything but the sentences; board and host compare it."""

    @classmethod
    def read(cls, text: str) -> Self:
        """Parse a schema file; WireError when it contradicts itself."""
        raw = tomllib.loads(text)
        schema = cls(
            name=raw["protocol"]["name"],
            major=raw["protocol"]["major"],
            minor=raw["protocol"]["minor"],
            to_device_bytes=raw["limits"]["to_device"],
            from_device_bytes=raw["limits"]["from_device"],
            enums={name: _enum(name, table) for name, table in raw["enums"].items()},
            structs={
                name: StructSpec(name, table["text"], _fields(table))
                for name, table in raw["structs"].items()
            },
            messages=tuple(_message(table) for table in raw["messages"]),
            hash=_hash(raw),
        )
        _check(schema)
        return schema

    @cached_property
    def by_name(self) -> dict[str, MessageSpec]:
        """Messages by their name."""
        return {message.name: message for message in self.messages}


def _enum(name: str, table: dict[str, Any]) -> EnumSpec:
    values = tuple((v["name"], v["value"], v["text"]) for v in table["values"])
    return EnumSpec(name, table["text"], values)


def _fields(table: dict[str, Any]) -> tuple[FieldSpec, ...]:
    return tuple(FieldSpec.read(field) for field in table["fields"])


def _message(table: dict[str, Any]) -> MessageSpec:
    to_device = {"to_device": True, "from_device": False}[table["direction"]]
    return MessageSpec(table["name"], table["type"], to_device, table["text"], _fields(table))


def _hash(raw: dict[str, Any]) -> int:
    canonical = json.dumps(_without_text(raw), sort_keys=True, separators=(",", ":"))
    return int.from_bytes(hashlib.sha256(canonical.encode()).digest()[:4], "little")


def _without_text(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _without_text(item) for key, item in value.items() if key != "text"}
    return [_without_text(item) for item in value] if isinstance(value, list) else value


def _check(schema: Schema) -> None:
    types = {message.type for message in schema.messages}
    if min(len(types), len(schema.by_name)) != len(schema.messages):
        raise WireError("two messages share a type byte or a name", where="protocol.toml")
    for message in schema.messages:
        where = f"protocol.toml: {message.name}"
        if any(field.is_tail for field in message.fields[:-1]):
            raise WireError("only the last field may fill the payload", where=where)
        for field in message.fields:
            if field.item not in SCALARS and not (field.is_tail and field.item in schema.structs):
                raise WireError(f'unknown type "{field.type_name}" of {field.name}', where=where)
            if field.enum and field.enum not in schema.enums:
                raise WireError(f'unknown enumeration "{field.enum}"', where=where)


SCHEMA = Schema.read(
    files("tomoskin.board.wire").joinpath("protocol.toml").read_text(encoding="utf-8")
)
"""The schema that this host was made with."""

OLDER = {(1, 0): 0x8B6ABBBD, (1, 1): 0xF17AB758}
"""Hashes of the published versions, by major and minor, that this host speaks besides its own."""
