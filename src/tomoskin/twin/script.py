"""A script's text → what happens on the sheet, and when; strict."""

from __future__ import annotations

import contextlib
import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Self

from tomoskin.core import GeometryError, ScriptError, SkinError
from tomoskin.model.section import toml_tables
from tomoskin.twin.course import Scripted, ScriptedBend, ScriptedPress, after, there_and_back
from tomoskin.twin.probe import Circle, Face, Finger, Shape, Square
from tomoskin.twin.script_schema import (
    FORMAT,
    SECTIONS,
    BendSection,
    FaultSection,
    MarkSection,
    PressesSection,
    PressSection,
    ScriptSection,
    StretchSection,
)

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
    faults: tuple[Scripted[FaultSection], ...]
    marks: tuple[Scripted[MarkSection], ...]
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
            tables = toml_tables(text, source, FORMAT, SECTIONS)
            if PressesSection.section in tables:
                raise ScriptError(
                    "describes labelled frames, not a timeline",
                    where=f"{source}: {PressesSection.heading}",
                    hint="give the number of frames: --presses N",
                )
            head = ScriptSection.read(tables.get("script", {}), f"{source}: [script]")
            presses = tuple(_press(s, w) for s, w in PressSection.each(tables, source))
            faults = tuple(_fault(s, w) for s, w in FaultSection.each(tables, source))
            marks = tuple(Scripted(s, w) for s, w in MarkSection.each(tables, source))
            bends = [ScriptedBend.of(s, w) for s, w in BendSection.each(tables, source)]
            bends += [ScriptedBend.of(s, w) for s, w in StretchSection.each(tables, source)]
        return cls(
            source,
            presses=presses,
            faults=faults,
            marks=marks,
            bends=tuple(bends),
            **vars(head),
        )


@contextlib.contextmanager
def of_script() -> Iterator[None]:
    """Turn errors of the reader of skin files into errors of a script."""
    try:
        yield
    except SkinError as error:
        raise ScriptError(error.message, where=error.where, hint=error.hint) from None


def _press(given: PressSection, where: str) -> ScriptedPress:
    force = there_and_back(given, given.force, where)
    path = after((0.0, *given.at), given.path, f"{where} path")
    return ScriptedPress(given, where, _shape(given, where), force, path)


def _shape(given: PressSection, where: str) -> Shape:
    crown = given.crown or math.inf
    match given:
        case PressSection(radius=float(radius)):
            return Circle(radius, crown)
        case PressSection(side=float(side)):
            return Square(side, crown)
        case PressSection(vertices=None):
            return Finger(given.length, given.width)
    try:
        return Face(given.vertices or (), crown)
    except GeometryError as error:
        raise ScriptError(error.message, where=f"{where} vertices", hint=error.hint) from None


def _fault(given: FaultSection, where: str) -> Scripted[FaultSection]:
    if given.end is not None and not given.end > given.start:
        raise ScriptError(
            f"expected a time after start, {given.start:g} s, got {given.end:g} s",
            where=f"{where} end",
            hint="times count from the end of the lead-in, not from start",
        )
    if given.other is not None and given.other == given.electrode:
        raise ScriptError(
            f"expected an electrode other than E{given.electrode + 1}, got the same",
            where=f"{where} other",
            hint="an electrode is always connected to itself",
        )
    return Scripted(given, where)
