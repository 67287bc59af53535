"""A script's text → what happens on the sheet, and when; strict."""

from __future__ import annotations

import contextlib
import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any, Self

from tomoskin.core import GeometryError, ScriptError, SkinError
from tomoskin.skin import check_names, read_section, show, toml_tables
from tomoskin.twin.disturbance import ScriptedFault
from tomoskin.twin.script_bend import ScriptedBend
from tomoskin.twin.script_schema import (
    BEND,
    FAULT,
    FORMAT,
    MARK,
    PRESS,
    PRESSES,
    SCRIPT,
    SECTIONS,
    STRETCH,
)
from tomoskin.twin.shape import Circle, Face, Finger, Shape, Square
from tomoskin.twin.timeline import Mark, Rows, ScriptedPress

_DEFAULT_SOURCE = "script"


@dataclass(frozen=True)
class Script:
    """A timeline of presses, faults and marks.

    Attributes
    ----------
    source
        Path of the file, for messages.
    name
        For people.
    duration, lead_in
        s; all times count from the end of the lead-in.
    seed
        Of all noise.
    presses, faults, marks, bends
        In the file's order.
    preset
        Name of the twin's settings; None for the skin's own.
    """

    source: str
    name: str
    duration: float
    lead_in: float
    seed: int
    presses: tuple[ScriptedPress, ...]
    faults: tuple[ScriptedFault, ...]
    marks: tuple[Mark, ...]
    preset: str | None = None
    bends: tuple[ScriptedBend, ...] = ()

    @classmethod
    def from_toml(cls, text: str, *, source: str = _DEFAULT_SOURCE) -> Self:
        """Script from its text; ``source`` names it in errors.

        Raises
        ------
        ScriptError
            For a key that is not known or missing, or a value that cannot be meant. Whether the
            whole can be run on a skin, :func:`check_script` says.
        """
        with of_script():
            tables = tables_of(text, source)
            if PRESSES.name in tables:
                raise ScriptError(
                    "describes labelled frames, not a timeline",
                    where=f"{source}: [{PRESSES.name}]",
                    hint="say how many frames: --presses N",
                )
            head = read_section(SCRIPT, tables.get("script", {}), f"{source}: [script]")
            presses = tuple(_press(v, w) for v, w in _each(tables, PRESS.name, source))
            faults = tuple(_fault(v, w) for v, w in _each(tables, FAULT.name, source))
            marks = tuple(Mark(v["at"], v["text"], w) for v, w in _each(tables, MARK.name, source))
            bends = [
                ScriptedBend.of(v["kind"], "angle", v, w)
                for v, w in _each(tables, BEND.name, source)
            ]
            bends += [
                ScriptedBend.of("stretch", "strain", v, w)
                for v, w in _each(tables, STRETCH.name, source)
            ]
        return cls(
            source=source, presses=presses, faults=faults, marks=marks, bends=tuple(bends), **head
        )


_MANY = {section.name: section for section in SECTIONS if section.many}


@contextlib.contextmanager
def of_script() -> Iterator[None]:
    """Turn errors of the reader of skin files into errors of a script."""
    try:
        yield
    except SkinError as error:
        raise ScriptError(error.message, where=error.where, hint=error.hint) from None


def tables_of(text: str, source: str) -> dict[str, Any]:
    """Sections of a script as written, known ones only."""
    tables = toml_tables(text, source, FORMAT)
    check_names(tables, [section.name for section in SECTIONS], "section", source)
    return tables


def _each(
    tables: Mapping[str, Any], name: str, source: str
) -> Iterator[tuple[dict[str, Any], str]]:
    """Values and place of each table of a list."""
    section = _MANY[name]
    given = tables.get(name, [])
    if not isinstance(given, list):
        raise ScriptError(
            f"expected a list of tables, got {show(given)}",
            where=f"{source}: [{name}]",
            hint=f"write {section.heading}, as there may be several",
        )
    for number, table in enumerate(given, start=1):
        title = table.get("id") if isinstance(table, Mapping) else None
        called = f' "{title}"' if isinstance(title, str) else ""
        where = f"{source}: {section.heading} {number}{called}"
        yield read_section(section, table, where), where


def _press(value: Mapping[str, Any], where: str) -> ScriptedPress:
    if "profile" in value:
        force, key = _course((0.0, 0.0), value["profile"], f"{where} profile"), "profile"
        if force[-1][1] != 0.0:
            raise ScriptError(
                f"expected 0 N last, got {force[-1][1]:g} N",
                where=f"{where} profile",
                hint="add a row with the time at which the probe has left the sheet",
            )
    else:
        force, key = _ramps(value), "hold"
    return ScriptedPress(
        id=value["id"],
        shape=_shape(value, where),
        angle=value["angle"],
        motion=value["motion"],
        start=value["start"],
        force=force,
        path=_course((0.0, *value["at"]), value.get("path", ()), f"{where} path"),
        force_key=key,
        where=where,
    )


def _shape(value: Mapping[str, Any], where: str) -> Shape:
    crown = value.get("crown", math.inf)
    match value["shape"]:
        case "circle":
            return Circle(value["radius"], crown)
        case "square":
            return Square(value["side"], crown)
        case "finger":
            return Finger(value["length"], value["width"])
    try:
        return Face(value["vertices"], crown)
    except GeometryError as error:
        raise ScriptError(error.message, where=f"{where} vertices", hint=error.hint) from None


def _fault(value: Mapping[str, Any], where: str) -> ScriptedFault:
    start, end = value["start"], value.get("end", value["start"])
    if "end" in value and not end > start:
        raise ScriptError(
            f"expected a time after start, {start:g} s, got {end:g} s",
            where=f"{where} end",
            hint="times count from the end of the lead-in, not from start",
        )
    electrode, other = value.get("electrode", -1), value.get("other", -1)
    if other >= 0 and other == electrode:
        raise ScriptError(
            f"expected an electrode other than {electrode}, got {other}",
            where=f"{where} other",
            hint="an electrode always touches itself",
        )
    amount = next((value[key] for key in ("lsb", "probability", "kelvin") if key in value), 0.0)
    return ScriptedFault(value["kind"], start, end, electrode, other, amount, where)


def _ramps(value: Mapping[str, Any]) -> Rows:
    """Up, hold, down."""
    top = value["rise"]
    held = top + value["hold"]
    force = value["force"]
    return ((0.0, 0.0), (top, force), (held, force), (held + value["fall"], 0.0))


def _course(first: tuple[float, ...], rows: Rows, where: str) -> Rows:
    """``rows`` after the ``first`` one, which stands at time 0."""
    if rows and not rows[0][0] > 0:
        raise ScriptError("row 0: expected a time above 0 s, got 0 s", where=where)
    return (first, *rows)
