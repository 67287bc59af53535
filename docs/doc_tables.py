"""Write the tables of the documentation that follow from declarations: `python docs/doc_tables.py`.

Each page is written by hand down to its mark. Below stand the keys of the skin file
(skin-file.md), of a script (simulate.md) and of the files that extras read, the numbers of the
twin (twin.md), the messages between board and host (protocol.md), and the boards (firmware.md).
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import fields, replace
from functools import partial
from importlib import import_module
from pathlib import Path
from typing import Any

from tomoskin.board.source import BOARDS
from tomoskin.board.wire import SCHEMA
from tomoskin.board.wire.schema import FieldSpec, MessageSpec
from tomoskin.core import extra_names
from tomoskin.model.section import Choice, Key, Section, literal
from tomoskin.model.skin import METHODS, SECTIONS
from tomoskin.twin import (
    PRESETS,
    BendSettings,
    ContactSettings,
    ElectronicsSettings,
    LineSettings,
    MaterialSettings,
)
from tomoskin.twin.presets import SOURCES
from tomoskin.twin.script_schema import SECTIONS as SCRIPT_SECTIONS

MARK = "<!-- from here on written by docs/doc_tables.py -->\n\n"
FOLDER = Path(__file__).parent

_STAGES = {
    "contact": ("Contact", ContactSettings),
    "material": ("Material", MaterialSettings),
    "electronics": ("Electronics", ElectronicsSettings),
    "bend": ("Bending", BendSettings),
}
"""Title and settings of each stage of the twin, by its name in a preset."""


_KEY_HEAD = ["key", "value", "default", "meaning"]


def tables(sections: Iterable[type[Section]]) -> str:
    """Heading, meaning and table of keys of each section."""
    return "\n".join(
        f"## {section.heading}\n\n{section.meaning}\n\n"
        + _table(_KEY_HEAD, map(_key_row, filter(None, map(_of_core, section.keys))))
        for section in sections
    )


def _of_core(key: Key) -> Key | None:
    """The key without the methods that extras add, whose own keys stand on their pages."""
    if METHODS and key.options is METHODS:
        first = key.meaning.split(f" {next(iter(METHODS))}: ")[0]
        meaning = f"{first} Extras add others."
        return replace(key, kind=Choice((str(key.default),)), meaning=meaning)
    return None if key.when and set(key.when[1]) <= set(METHODS) else key


def parameter_tables() -> str:
    """A table for each stage of the twin, with a column for each preset; and the line's."""
    return "\n".join([*map(_stage, _STAGES), _line()])


def schema_tables() -> str:
    """The bytes of every message of the protocol, its groups, and its values."""
    parts = []
    for title, to_device in (("From the board", False), ("To the board", True)):
        first = "Byte 0 is the type that stands in the heading"
        then = ", byte 1 the request id; what follows them is in the tables" if to_device else ""
        parts.append(f"## {title}\n\n{first}{then}.\n")
        messages = [one for one in SCHEMA.messages if one.to_device == to_device]
        for place, message in enumerate(messages):
            parts.append(f"### {message.name} (0x{message.type:02X})\n\n{message.text}.\n")
            parts += filter(None, [_message_table(message, messages[:place])])
    parts.append("## Groups and values\n")
    for name, struct in SCHEMA.structs.items():
        table = _table(_BYTES, _field_rows(struct.fields, 0))
        parts.append(f"### {name}\n\n{struct.text}.\n\n{table}")
    for name, enum in SCHEMA.enums.items():
        rows = [[str(one.value), one.name, one.text] for one in enum.values]
        table = _table(["value", "name", "meaning"], rows)
        parts.append(f"### {name}\n\n{enum.text}.\n\n{table}")
    return "\n".join(parts)


def board_table() -> str:
    """What the records of the boards say, a row a board."""
    head = ["name", "board", "channels", "converter", "values in a frame", "alternating drive"]
    rows = (
        [
            f"`{name}`",
            board.text,
            ", ".join(map(str, board.channels)),
            f"{board.adc_bits} bits, {1e6 * board.converter.conversion(64):g} µs",
            str(board.max_samples),
            f"{board.chop.min_chop} to {board.chop.max_chop} Hz" if board.chop.max_chop else "none",
        ]
        for name, board in BOARDS.items()
    )
    return f"### The boards\n\n{_table(head, rows)}"


_BYTES = ["byte", "field", "type", "meaning"]


def _message_table(message: MessageSpec, before: Sequence[MessageSpec]) -> str:
    """Its fields: the last alone where all others are those of a message ``before`` it."""
    rows = list(_field_rows(message.fields, 1))[message.to_device :]
    layout = [(field.name, field.type_name) for field in message.fields[:-1]]
    for other in before if len(layout) > 3 else ():
        if [(field.name, field.type_name) for field in other.fields[:-1]] == layout:
            last = _table(_BYTES, rows[-1:])
            return f"All fields but the last are those of {other.name}.\n\n{last}"
    return _table(_BYTES, rows) if rows else ""


def _field_rows(fields: Iterable[FieldSpec], start: int) -> Iterator[list[str]]:
    for field in fields:
        unit = f", {field.unit}" if field.unit else ""
        link = f" (see {field.enum})" if field.enum else ""
        yield [str(start), field.name, field.type_name, field.text + unit + link]
        start += field.size


PAGES: dict[str, Callable[[], str]] = {
    "skin-file.md": lambda: tables(SECTIONS.values()),
    "simulate.md": lambda: tables(SCRIPT_SECTIONS.values()),
    "twin.md": parameter_tables,
    "protocol.md": schema_tables,
    "firmware.md": board_table,
}

for extra in extra_names():  # the page of an extra goes with it
    if own := getattr(import_module(f"tomoskin.extras.{extra}"), "SECTIONS", None):
        PAGES[f"extras/{extra}.md"] = partial(tables, own.values())


def written(page: str) -> str:
    """Text that ``page`` should have, with its own words above the mark."""
    above, _ = (FOLDER / page).read_text(encoding="utf-8").split(MARK)
    return above + MARK + PAGES[page]()


def examples(page: str) -> list[str]:
    """The TOML files that ``page`` shows."""
    _, *blocks = (FOLDER / page).read_text(encoding="utf-8").split("```toml\n")
    return [block.partition("```")[0] for block in blocks]


def documented(record: type[Any]) -> Iterator[tuple[str, str, str, str]]:
    """Name, unit, meaning and source of each number of a settings record."""
    for one in fields(record):
        yield one.name, *(one.metadata[key] for key in ("unit", "meaning", "source"))


def _table(head: list[str], rows: Iterable[list[str]]) -> str:
    lines = [head, ["---"] * len(head), *rows]
    return "".join(f"| {' | '.join(cells)} |\n" for cells in lines).replace(" --- ", "---")


def _key_row(key: Key) -> list[str]:
    cells = [f"`{key.name}`", key.kind.expected, _default(key), key.meaning]
    return [cell.replace("|", "\\|") for cell in cells]


def _default(key: Key) -> str:
    if key.default is not None:
        text = f"`{literal(key.default)}`"
    else:
        text = "required" if key.required else "none"
    if key.when:
        text += f" for {' and '.join(key.when[1])}"
    if key.effective:
        other, words = key.effective
        text += f", has an effect with `{other}` {' or '.join(words)}"
    if key.unless:
        text += f", unless `{key.unless}` is there"
    return text


def _stage(stage: str) -> str:
    title, record = _STAGES[stage]
    rows = (
        [f"`{name}`{unit and f', {unit}'}"]
        + [_shown(getattr(getattr(preset, stage), name)) for preset in PRESETS.values()]
        + [f"{meaning} {_sourced(SOURCES.get(name, source))}".strip()]
        for name, unit, meaning, source in documented(record)
    )
    head = ["number, unit", *PRESETS, "meaning (source)"]
    return f"### {title}: `{record.__name__}`\n\n{_table(head, rows)}"


def _line() -> str:
    rows = (
        [f"`{name}`", _shown(getattr(LineSettings(), name)), meaning]
        for name, _, meaning, _ in documented(LineSettings)
    )
    return f"### Line: `LineSettings`\n\n{_table(['number', 'default', 'meaning'], rows)}"


def _sourced(source: str) -> str:
    """In brackets, unless it is assumed: what the defaults have as ideal, the presets assume."""
    return f"({source})" if source not in ("", "ideal", "assumed") else ""


def _shown(value: object) -> str:
    if isinstance(value, tuple):
        return ", ".join(map(_shown, value)) or "none"
    return f"{value:g}" if isinstance(value, float) else str(value)


if __name__ == "__main__":
    for page in PAGES:
        (FOLDER / page).write_text(written(page), encoding="utf-8")
