"""The skin file: outline, electrodes, material, drive, readout, mesh and settings; strict.

What reads it (:class:`Section`, :func:`key`, kinds of values) also reads other TOML files.
"""

from tomoskin.model.skin.body import ReadoutSettings
from tomoskin.model.skin.build import SECTIONS
from tomoskin.model.skin.find import read_text
from tomoskin.model.skin.hysteresis import (
    SCALAR,
    MaterialMemory,
    MemoryState,
    Metric,
    advanced,
    broken_down,
    check_step,
    followed,
    load_of,
    response,
    responses,
)
from tomoskin.model.skin.kinds import (
    Choice,
    Number,
    NumberOrWord,
    OneOrEach,
    OneOrMore,
    OneOrSpan,
    Quantity,
    Row,
    Table,
    Text,
    ValueKind,
    Whole,
    Words,
    literal,
    show,
)
from tomoskin.model.skin.lay import lay
from tomoskin.model.skin.processing import (
    InverseSettings,
    SignalSettings,
    TouchSettings,
    TwinChoice,
)
from tomoskin.model.skin.section import Key, Section, check_names, key, toml_tables
from tomoskin.model.skin.skin import Skin

__all__ = [
    "SCALAR",
    "SECTIONS",
    "Choice",
    "InverseSettings",
    "Key",
    "MaterialMemory",
    "MemoryState",
    "Metric",
    "Number",
    "NumberOrWord",
    "OneOrEach",
    "OneOrMore",
    "OneOrSpan",
    "Quantity",
    "ReadoutSettings",
    "Row",
    "Section",
    "SignalSettings",
    "Skin",
    "Table",
    "Text",
    "TouchSettings",
    "TwinChoice",
    "ValueKind",
    "Whole",
    "Words",
    "advanced",
    "broken_down",
    "check_names",
    "check_step",
    "followed",
    "key",
    "lay",
    "literal",
    "load_of",
    "read_text",
    "response",
    "responses",
    "show",
    "toml_tables",
]
