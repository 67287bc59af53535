"""The firmware's protocol header and the types of the Python records, made from the schema.

``python scripts/firmware_header.py`` writes them, ``… --check`` fails when one is stale.
"""

from __future__ import annotations

import re
import sys
from pathlib import Path

from tomoskin.board.wire import SCHEMA, Schema
from tomoskin.board.wire.messages import FRAMES, class_name
from tomoskin.board.wire.schema import SCALARS, FieldSpec

ROOT = Path(__file__).resolve().parent.parent
HEADER = ROOT / "firmware" / "src" / "protocol.h"
STUB = ROOT / "src" / "tomoskin" / "board" / "wire" / "messages.pyi"


def header(schema: Schema) -> str:
    """Return the header: versions, hash, limits, message types, sizes, offsets, numbers, values."""
    parts = [
        "/* The wire protocol. Made from src/tomoskin/board/wire/protocol.toml by\n"
        "   scripts/firmware_header.py: change that file, not this one. */",
        "#ifndef TOMOSKIN_PROTOCOL_H\n#define TOMOSKIN_PROTOCOL_H\n\n#include <stdint.h>",
        "\n".join(
            (
                f"#define PROTOCOL_MAJOR {schema.major}u",
                f"#define PROTOCOL_MINOR {schema.minor}u",
                f"#define PROTOCOL_HASH UINT32_C(0x{schema.hash:08X})",
                f"#define MOST_TO_DEVICE {schema.to_device_bytes}u",
                f"#define MOST_FROM_DEVICE {schema.from_device_bytes}u",
            )
        ),
        "/* MSG_: type byte. SIZE_: payload, type byte included, without what fills the rest.\n"
        "   AT_: place in the payload. FIELD_: number of the field, from 0. */",
    ]
    for message in schema.messages:
        parts.append(_message(message.name, message.type, message.fields))
    for name, struct in schema.structs.items():
        lines, size = _places(name.upper(), struct.fields, 0)
        parts.append("\n".join([*lines, f"#define SIZE_{name.upper()} {size}u"]))
    for name, enum in schema.enums.items():
        values = "\n".join(f"#define {name.upper()}_{one.name} {one.value}u" for one in enum.values)
        parts.append(f"/* {enum.text}. */\n{values}")
    return "\n\n".join([*parts, "#endif"]) + "\n"


def _message(name: str, type_byte: int, fields: tuple[FieldSpec, ...]) -> str:
    lines, size = _places(name, fields, 1)
    numbers = [f"#define FIELD_{name}_{f.name.upper()} {n}u" for n, f in enumerate(fields)]
    head = [f"#define MSG_{name} 0x{type_byte:02X}u", f"#define SIZE_{name} {size}u"]
    return "\n".join([*head, *lines, *numbers])


def _places(prefix: str, fields: tuple[FieldSpec, ...], start: int) -> tuple[list[str], int]:
    lines = []
    for field in fields:
        lines.append(f"#define AT_{prefix}_{field.name.upper()} {start}u")
        start += field.size
    return lines, start


def stub(schema: Schema) -> str:
    """Return the types of the records, for type checkers and for readers of the code."""
    parts = [_STUB_HEAD]
    for name, enum in schema.enums.items():
        base = "IntFlag" if name == "flag" else "IntEnum"
        values = "".join(f"    {one.name} = {one.value}\n" for one in enum.values)
        parts.append(f'class {class_name(name)}({base}):\n    """{enum.text}."""\n\n{values}')
    records = [message for message in schema.messages if message.name not in FRAMES]
    named = [*schema.structs.items(), *((record.name, record) for record in records)]
    for name, record in named:
        base = "(Named)" if any(field.name == "name" for field in record.fields) else ""
        fields = "".join(f"    {field.name}: {_annotation(field)}\n" for field in record.fields)
        head = f'class {class_name(name)}{base}:\n    """{_short(record.text)}."""'
        parts.append(f"@dataclass(frozen=True, slots=True)\n{head}\n\n{fields}")
    for name, to_device in (("Command", True), ("_Report", False)):
        names = [class_name(record.name) for record in records if record.to_device == to_device]
        line = f"{name} = {' | '.join(names)}"
        over = f"{name} = (\n    {chr(10).join(names).replace(chr(10), chr(10) + '    | ')}\n)"
        parts.append((line if len(line) <= _WIDTH else over) + "\n")
    return "\n".join([*parts, "Message = Command | _Report | Frame | DriveSamples\n"])


_WIDTH = 100

_STUB_HEAD = """# The records of the wire protocol. Made from protocol.toml by
# scripts/firmware_header.py: change that file, not this one.
from dataclasses import dataclass
from enum import Enum, IntEnum, IntFlag
from typing import Any

from tomoskin.core import DriveSamples, Frame

FRAMES: dict[str, type]
RECORDS: dict[str, type[Any]]
STRUCTS: dict[str, type[Any]]
ENUMS: dict[str, type[Enum]]

def class_name(name: str) -> str: ...

class Named:
    name: bytes
    @property
    def text(self) -> str: ...
"""


def _annotation(field: FieldSpec) -> str:
    if field.item not in SCALARS:
        return f"tuple[{class_name(field.item)}, ...]"
    return class_name(field.enum) if field.enum else "int" if field.length == 1 else "bytes"


def _short(text: str) -> str:
    """Return the first part of a sentence, which fits a line."""
    return re.split(r"\. |; |: sent", text)[0]


def main() -> int:
    """Write the files, or say whether those that are there are right."""
    stale = 0
    for file, made in ((HEADER, header(SCHEMA)), (STUB, stub(SCHEMA))):
        if sys.argv[1:] != ["--check"]:
            file.write_text(made, encoding="utf-8")
        elif file.read_text(encoding="utf-8") != made:
            print(f"{file.name} is stale: run python {Path(__file__).name}", file=sys.stderr)
            stale = 1
    return stale


if __name__ == "__main__":
    sys.exit(main())
