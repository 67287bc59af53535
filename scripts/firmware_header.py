"""The firmware's protocol header, made from the schema that the Python codec is driven from.

``python scripts/firmware_header.py`` writes it, ``… --check`` fails when it is stale.
"""

from __future__ import annotations

import sys
from pathlib import Path

from tomoskin.board.wire import SCHEMA, Schema
from tomoskin.board.wire.schema import FieldSpec

HEADER = Path(__file__).resolve().parent.parent / "firmware" / "src" / "protocol.h"
_SIZES = {"u8": 1, "u16": 2, "u32": 4, "u64": 8}


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
    for struct in schema.structs.values():
        lines, size = _places(struct.name.upper(), struct.fields, 0)
        parts.append("\n".join([*lines, f"#define SIZE_{struct.name.upper()} {size}u"]))
    for enum in schema.enums.values():
        values = "\n".join(
            f"#define {enum.name.upper()}_{name} {value}u" for name, value, _ in enum.values
        )
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
        start += _SIZES.get(field.item, 0) * field.length
    return lines, start


def main() -> int:
    """Write the header, or say whether the one that is there is right."""
    made = header(SCHEMA)
    if sys.argv[1:] == ["--check"]:
        if HEADER.read_text(encoding="utf-8") == made:
            return 0
        print(f"{HEADER.name} is stale: run python {Path(__file__).name}", file=sys.stderr)
        return 1
    HEADER.write_text(made, encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
