"""The skin file: outline, electrodes, material, drive, readout, mesh and settings; strict.

What reads it (:class:`Section`, :class:`Key`, kinds of values) also reads other TOML files.
"""

from tomoskin.skin.kinds import (
    Choice,
    Kind,
    Number,
    NumberOrWord,
    OneOrEach,
    Quantity,
    Rows,
    Text,
    Whole,
    read_entry,
    show,
)
from tomoskin.skin.lay import lay
from tomoskin.skin.page import section_text, skin_file_page
from tomoskin.skin.read import check_names, read_section, toml_tables
from tomoskin.skin.schema import SECTIONS, Key, Section
from tomoskin.skin.settings import (
    InverseSettings,
    ReadoutSettings,
    SignalSettings,
    TouchSettings,
    TwinChoice,
)
from tomoskin.skin.skin import Skin

__all__ = [
    "SECTIONS",
    "Choice",
    "InverseSettings",
    "Key",
    "Kind",
    "Number",
    "NumberOrWord",
    "OneOrEach",
    "Quantity",
    "ReadoutSettings",
    "Rows",
    "Section",
    "SignalSettings",
    "Skin",
    "Text",
    "TouchSettings",
    "TwinChoice",
    "Whole",
    "check_names",
    "lay",
    "read_entry",
    "read_section",
    "section_text",
    "show",
    "skin_file_page",
    "toml_tables",
]
