"""The documentation page of the skin file, written from the schema (docs/skin-file.md)."""

from __future__ import annotations

from tomoskin.skin.kinds import literal
from tomoskin.skin.schema import SECTIONS, Key, Section

_HEAD = """\
# The skin file

A skin file describes one sensor sheet in TOML. Every quantity is a text with its unit, such as
`"200 mm"`. Unknown sections and keys, wrong units and values out of range are errors that name
the file, the section and the key. `tomoskin skin check FILE` checks a file, `tomoskin skin show
NAME` prints one with all defaults written out.

The first line is `format = 1`. Directions and order are as seen from the front of the sheet, x to
the right, y up. Electrodes are E1, E2, … for people and 0, 1, … in tables.

A file with all that is required:

```toml
"""

EXAMPLE = """\
format = 1

[skin]
name = "my-sheet"

[outline]
shape = "disc"
diameter = "200 mm"

[electrodes]
count = 8
width = "10 mm"
contact_impedance = "0.2 mohm*m"

[material]
sheet_resistance = "0.8 ohm/sq"

[drive]
current = "100 mA"
"""
"""The page's example of a skin file."""

_TABLE = """\
| key | value | default | meaning |
|---|---|---|---|
"""


def skin_file_page() -> str:
    """Text of docs/skin-file.md."""
    sections = "\n".join(section_text(section) for section in SECTIONS)
    return f"{_HEAD}{EXAMPLE}```\n\n{sections}"


def section_text(section: Section) -> str:
    """A section's heading, meaning and table of keys, in Markdown."""
    rows = "".join(_row(key) for key in section.keys)
    return f"## {section.heading}\n\n{section.meaning}\n\n{_TABLE}{rows}"


def _row(key: Key) -> str:
    cells = [f"`{key.name}`", key.kind.expected, _default(key), key.meaning]
    return f"| {' | '.join(cell.replace('|', chr(92) + '|') for cell in cells)} |\n"


def _default(key: Key) -> str:
    if key.default is not None:
        text = f"`{literal(key.default)}`"
    else:
        text = "required" if key.required else "none"
    if key.when:
        text += f" for {' and '.join(key.when[1])}"
    if key.unless:
        text += f", unless `{key.unless}` is there"
    return text
