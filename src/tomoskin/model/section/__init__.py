"""Sections of TOML files as records: each field says what its key may be and what it is for."""

from tomoskin.model.section.kinds import (
    Choice,
    Number,
    NumberOrWord,
    OneOrMore,
    OneOrSpan,
    Quantity,
    Row,
    Table,
    Text,
    ValueKind,
    Whole,
    literal,
    show,
)
from tomoskin.model.section.section import (
    Document,
    Key,
    Section,
    check_names,
    key,
    toml_tables,
    toml_text,
)

__all__ = [
    "Choice",
    "Document",
    "Key",
    "Number",
    "NumberOrWord",
    "OneOrMore",
    "OneOrSpan",
    "Quantity",
    "Row",
    "Section",
    "Table",
    "Text",
    "ValueKind",
    "Whole",
    "check_names",
    "key",
    "literal",
    "show",
    "toml_tables",
    "toml_text",
]
