"""The page's types and the readers of its frame, made from what the server declares.

``python scripts/page_types.py`` writes them, ``… --check`` fails when they are stale.
"""

from __future__ import annotations

import re
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from msgspec import inspect

from tomoskin.learning import ShownReading
from tomoskin.run import StrictRequest
from tomoskin.server import frames, page_messages, requests, robot_messages, settings_messages

TYPES = Path(__file__).resolve().parent.parent / "web" / "src" / "wire.ts"
_HEAD = """\
/** What goes between the page and its server. Made by scripts/page_types.py from page_messages.py,
 * robot_messages.py, settings_messages.py, requests.py and frames.py of src/tomoskin/server:
 * change those. */
"""
_GETTERS = {"u1": "Uint8", "u2": "Uint16", "u4": "Uint32", "f4": "Float32", "f8": "Float64"}
_UNNAMED = ("magic",)


def types() -> str:
    """Return the whole module."""
    sent = requests.REQUESTS
    to_skin = (*page_messages.PAGE_MESSAGES, *settings_messages.SETTINGS_MESSAGES)
    unions = {
        "ServerMessage": to_skin,
        "RobotMessage": robot_messages.ROBOT_MESSAGES,
        "PageRequest": sent,
    }
    roots = [*to_skin, *robot_messages.ROBOT_MESSAGES, *sent]
    made: dict[str, str] = {}
    others = robot_messages.RobotTouches, ShownReading, page_messages.DeformationNow
    for info in inspect.multi_type_info([*roots, *others]):
        _type(info, made)
    parts = [*made.values()]
    for name, members in unions.items():
        names = "\n".join(f"  | {member.__name__}" for member in members)
        parts.append(f"export type {name} =\n{names};")
    value = _type(inspect.type_info(requests.Value), {}).removesuffix(" | null")
    text = "\n\n".join(parts).replace(value, "Value")
    alias = f"/** A value as a skin file writes it. */\nexport type Value = {value};"
    return "\n\n".join([_HEAD.rstrip(), alias, text, *_records()]) + "\n"


def _records() -> Iterator[str]:
    """The readers of the frame's records, and its flags."""
    for name, record in frames.RECORDS.items():
        yield f"export const {name.upper()}_BYTES = {record.itemsize};"
        lines = "\n".join(
            f"  {_camel(field)}: {_getter(*record.fields[field][:2])},"
            for field in record.names or ()
            if record.fields and field not in _UNNAMED
        )
        yield f"export const read{name} = (data: DataView, at: number) => ({{\n{lines}\n}});"
    flags = ", ".join(f"{_camel(flag.name or '')}: {flag.value}" for flag in frames.Flag)
    yield f"export const FLAGS = {{ {flags} }} as const;"
    yield f"export const MAGIC = 0x{int.from_bytes(frames.MAGIC, 'little'):x};"
    yield f"export const DENT_STEP = {frames.DENT_STEP:g};"


def _getter(kind: np.dtype[Any], offset: int) -> str:
    order = ", true" if kind.itemsize > 1 else ""
    place = f"at + {offset}" if offset else "at"
    return f"data.get{_GETTERS[kind.str[1:]]}({place}{order})"


def _camel(name: str) -> str:
    return re.sub(r"_(.)", lambda found: found[1].upper(), name.lower())


_PLAIN: dict[type, str] = {
    inspect.IntType: "number",
    inspect.FloatType: "number",
    inspect.StrType: "string",
    inspect.BoolType: "boolean",
    inspect.NoneType: "null",
}


def _type(info: Any, made: dict[str, str]) -> str:
    """Return what TypeScript calls the type; the interfaces that it needs go to ``made``."""
    if (plain := _PLAIN.get(type(info))) is not None:
        return plain
    match info:
        case inspect.StructType() | inspect.DataclassType():
            name = _interface(info, made)
        case inspect.LiteralType():
            name = " | ".join(f'"{value}"' for value in info.values)
        case inspect.UnionType():
            name = _union([_type(one, made) for one in info.types])
        case inspect.ListType() | inspect.VarTupleType():
            item = _type(info.item_type, made)
            name = f"readonly ({item})[]" if " " in item else f"readonly {item}[]"
        case inspect.TupleType():
            name = f"readonly [{', '.join(_type(one, made) for one in info.item_types)}]"
        case inspect.DictType():
            name = f"Readonly<Record<string, {_type(info.value_type, made)}>>"
        case _:
            raise TypeError(f"the page has no type for {info}")
    return name


def _union(names: list[str]) -> str:
    ordered = sorted(dict.fromkeys(names), key=lambda name: name == "null")
    return " | ".join(ordered)


def _interface(info: Any, made: dict[str, str]) -> str:
    name = info.cls.__name__
    if name in made:
        return str(name)
    made[name] = ""  # in its place before those that it needs, and once where it holds itself
    asked = issubclass(info.cls, StrictRequest)
    config = getattr(info.cls, "__struct_config__", None)
    left_out = asked or (config is not None and config.omit_defaults)
    lines = [f'  readonly type: "{info.tag}";'] if getattr(info, "tag", None) else []
    for field in info.fields:
        optional = left_out and not field.required
        kind = _type(field.type, made)
        if optional and not asked:
            kind = kind.removesuffix(" | null")
        lines.append(f"  readonly {field.encode_name}{'?' if optional else ''}: {kind};")
    text = " ".join((info.cls.__doc__ or "").partition("\n\n")[0].split())
    body = "\n".join(lines)
    made[name] = f"/** {text} */\nexport interface {name} {{\n{body}\n}}"
    return str(name)


def main() -> int:
    """Write the types, or say whether those that are there are right."""
    made = types()
    if sys.argv[1:] == ["--check"]:
        if TYPES.read_text(encoding="utf-8") == made:
            return 0
        print(f"{TYPES.name} is stale: run python {Path(__file__).name}", file=sys.stderr)
        return 1
    TYPES.write_text(made, encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
