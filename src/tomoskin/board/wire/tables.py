"""The schema as Markdown tables: docs/protocol.md is kept in step with them."""

from __future__ import annotations

from collections.abc import Iterable

from tomoskin.board.wire.schema import SCALARS, EnumSpec, FieldSpec, MessageSpec, Schema, StructSpec

_SIZE = {"u8": 1, "u16": 2, "u32": 4, "u64": 8}


def message_table(message: MessageSpec, structs: dict[str, StructSpec]) -> str:
    """Offset, field, type and meaning, from the type byte on."""
    first: list[tuple[str, ...]] = [("0", "type", "u8", f"0x{message.type:02X}")]
    return _table(("byte", "field", "type", "meaning"), first + _rows(message.fields, 1, structs))


def struct_table(struct: StructSpec) -> str:
    """Offset, field, type and meaning within one repetition."""
    return _table(("byte", "field", "type", "meaning"), _rows(struct.fields, 0, {}))


def enum_table(enum: EnumSpec) -> str:
    """Value, name and meaning."""
    return _table(("value", "name", "meaning"), [(str(v), n, t) for n, v, t in enum.values])


def schema_tables(schema: Schema) -> str:
    """Everything in the schema, as the reference part of the document."""
    parts = []
    for title, to_device in (("From the board", False), ("To the board", True)):
        parts.append(f"## {title}\n")
        for message in schema.messages:
            if message.to_device == to_device:
                parts.append(f"### {message.name} (0x{message.type:02X})\n\n{message.text}.\n")
                parts.append(message_table(message, schema.structs))
    parts.append("## Groups and values\n")
    parts += [f"### {s.name}\n\n{s.text}.\n\n{struct_table(s)}" for s in schema.structs.values()]
    parts += [f"### {e.name}\n\n{e.text}.\n\n{enum_table(e)}" for e in schema.enums.values()]
    return "\n".join(parts)


def _rows(
    fields: Iterable[FieldSpec], start: int, structs: dict[str, StructSpec]
) -> list[tuple[str, ...]]:
    rows: list[tuple[str, ...]] = []
    place = start
    for field in fields:
        unit = f", {field.unit}" if field.unit else ""
        link = f" (see {field.enum})" if field.enum else ""
        rows.append((str(place), field.name, field.type_name, field.text + unit + link))
        place += _size(field.item, structs) * field.length
    return rows


def _size(item: str, structs: dict[str, StructSpec]) -> int:
    if item in SCALARS:
        return _SIZE[item]
    return sum(_size(field.item, structs) for field in structs[item].fields)


def _table(head: tuple[str, ...], rows: Iterable[tuple[str, ...]]) -> str:
    lines = [head, tuple("---" for _ in head), *rows]
    return "".join("| " + " | ".join(line) + " |\n" for line in lines)
