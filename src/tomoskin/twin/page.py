"""The tables of docs/twin.md: every number of the twin, from the records themselves."""

from __future__ import annotations

from typing import Any

from tomoskin.twin.bend import BendSettings
from tomoskin.twin.circuit import ElectronicsSettings
from tomoskin.twin.contact import ContactSettings
from tomoskin.twin.line import LineSettings
from tomoskin.twin.material import MaterialSettings
from tomoskin.twin.parameters import documented
from tomoskin.twin.settings import PRESETS, SOURCES

_STAGES = (
    ("Contact", ContactSettings, 0),
    ("Material", MaterialSettings, 1),
    ("Electronics", ElectronicsSettings, 2),
    ("Bending", BendSettings, 3),
)


def parameter_tables() -> str:
    """Markdown: one table a stage, with a column for each preset."""
    return "\n".join([_stage(*stage) for stage in _STAGES] + [_line()])


def _stage(title: str, record: type[Any], place: int) -> str:
    names = " | ".join(PRESETS)
    lines = [
        f"### {title}: `{record.__name__}`",
        "",
        f"| number | unit | {names} | meaning | source |",
        "|---|---" + "|---" * (len(PRESETS) + 2) + "|",
    ]
    for name, unit, meaning, source in documented(record):
        shown = [_shown(getattr(parts[place], name)) for parts in PRESETS.values()]
        cells = [f"`{name}`", unit, *shown, meaning, SOURCES.get(name, _assumed(source))]
        lines.append(f"| {' | '.join(cells)} |")
    return "\n".join([*lines, ""])


def _line() -> str:
    lines = ["### Line: `LineSettings`", "", "| number | default | meaning |", "|---|---|---|"]
    for name, _, meaning, _ in documented(LineSettings):
        lines.append(f"| `{name}` | {_shown(getattr(LineSettings(), name))} | {meaning} |")
    return "\n".join([*lines, ""])


def _assumed(source: str) -> str:
    """What the defaults have as ideal, the presets assume."""
    return "assumed" if source == "ideal" else source


def _shown(value: object) -> str:
    if isinstance(value, tuple):
        return ", ".join(map(_shown, value)) or "none"
    return f"{value:g}" if isinstance(value, float) else str(value)
