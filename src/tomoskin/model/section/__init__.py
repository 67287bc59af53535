"""Sections of TOML files as records: each field says what its key may be and what it is for."""

from tomoskin.model.section.kinds import (
    Choice as Choice,
    Number as Number,
    NumberOrWord as NumberOrWord,
    OneOrMore as OneOrMore,
    OneOrSpan as OneOrSpan,
    Quantity as Quantity,
    Row as Row,
    Table as Table,
    Text as Text,
    ValueKind as ValueKind,
    Whole as Whole,
    literal as literal,
)
from tomoskin.model.section.section import (
    Document as Document,
    Key as Key,
    Section as Section,
    check_names as check_names,
    key as key,
    toml_tables as toml_tables,
    toml_text as toml_text,
)
