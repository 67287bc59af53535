"""The skin's settings and the twin, as a page is told of them; its schema and document as
messages, from which a page makes its forms. See ``server/page_messages.py``."""

from __future__ import annotations

import re
from collections.abc import Mapping
from functools import cache
from typing import Any, Literal

from msgspec.structs import replace

from tomoskin.core import PatternError, SkinError, TomoskinError
from tomoskin.model import section as sections
from tomoskin.model.pattern import named
from tomoskin.model.skin import SECTIONS, Skin
from tomoskin.server.page_messages import Message, MessagePart
from tomoskin.server.requests import Value


class KindForm(MessagePart, frozen=True, omit_defaults=True):
    """What a value may be, for a form; ``names`` and ``inner`` are of the columns of rows."""

    form: Literal["choice", "number", "quantity", "rows", "text"]
    words: tuple[str, ...] | None = None
    low: float | None = None
    high: float | None = None
    unit: str | None = None
    names: tuple[str, ...] | None = None
    inner: KindForm | None = None


class Condition(MessagePart, frozen=True):
    """One of these ``words`` as the value of another key."""

    key: str
    words: tuple[str, ...]


class KeyForm(MessagePart, frozen=True):
    """One key of a section.

    ``expected``: what a value must be, in words; ``when``: beside what it may stand;
    ``effective``: with what it does anything; ``unless``: the key that it may not stand beside.
    """

    name: str
    kind: KindForm
    expected: str
    meaning: str
    required: bool
    when: Condition | None
    effective: Condition | None
    unless: str | None
    locked: bool


class SectionForm(MessagePart, frozen=True):
    """The form of one section of a skin file."""

    name: str
    meaning: str
    keys: list[KeyForm]


class SchemaForm(Message, frozen=True, tag="schema"):
    """Every section and key of a skin file."""

    sections: list[SectionForm]


class Settings(Message, frozen=True, tag="settings"):
    """The skin's settings by section; ``took_ms``: how long the last change took."""

    document: Mapping[str, Mapping[str, Value]]
    n_electrodes: int
    automatic_alpha: float | None
    alpha: float
    undo: int
    redo: int
    busy: bool
    took_ms: float | None
    files: list[str]
    builtin: tuple[str, ...]


StageName = Literal["mesh", "model", "image", "touches", "source"]


class Progress(Message, frozen=True, tag="progress"):
    """How far a change has come: ``done`` of ``stages``; ``stage`` null: before the first."""

    stage: StageName | None
    done: int
    stages: int


class SettingRefused(Message, frozen=True, tag="settings_error"):
    """A setting was refused; section and key where the error names them."""

    section: str | None
    key: str | None
    message: str


class PatternTable(Message, frozen=True, tag="pattern"):
    """The measurements of a named pattern, to be edited."""

    name: str
    drive: list[tuple[int, int]]
    measure: list[tuple[int, int]]


# The twin.


class TwinBend(MessagePart, frozen=True):
    """By ``angle`` rad, over a strip of ``length`` along ``axis``, rad from x, ``offset`` m off."""

    angle: float
    axis: float
    length: float
    offset: float


class TwinStretch(MessagePart, frozen=True):
    """Relative elongations along ``axis``, rad from x, and across it."""

    along: float
    across: float
    axis: float


class TwinState(Message, frozen=True, tag="twin"):
    """What is wrong with the twin, and how it is bent; ``noise`` LSB, null: its own.

    ``bends``: along a strip, or at the joint that it lies on; ``size_m``: its largest extent.
    """

    breakable: bool
    cut: list[int]
    noise: float | None
    bendable: bool
    bends: Literal["hinge", "joint"] | None
    bend: TwinBend | None
    stretch: TwinStretch | None
    size_m: float


class TwinRefused(Message, frozen=True, tag="twin_refused"):
    """The twin cannot be bent in this way."""

    message: str


SETTINGS_MESSAGES = (
    *(SchemaForm, Settings, Progress, SettingRefused, PatternTable),
    *(TwinState, TwinRefused),
)


Changes = Mapping[str, Mapping[str, Any]]
"""Values by section and key, as a skin file writes them; None takes a key out."""

MOST_ROWS = 2000
"""Rows of a pattern that a page may edit one by one."""

LOCKED = frozenset({("surface", "file")})
"""Keys that name files: a page cannot set them."""

_PLACE = re.compile(r"\[(\w+)\](?: (\w+))?(?:, (.+))?$")
"""Section, key, and what of them: ``[electrodes], E4``."""


@cache
def schema() -> SchemaForm:
    """Every section and key: kinds, bounds, units, meanings and conditions."""
    return SchemaForm(
        sections=[
            SectionForm(
                name=section.section,
                meaning=section.meaning,
                keys=[
                    KeyForm.of(
                        key,
                        kind=_form(key.kind),
                        expected=key.kind.expected,
                        when=_condition(key.when),
                        effective=_condition(key.effective),
                        unless=key.unless or None,
                        locked=(section.section, key.name) in LOCKED,
                    )
                    for key in section.keys
                ],
            )
            for section in SECTIONS.values()
        ]
    )


def _condition(of: tuple[str, tuple[str, ...]] | None) -> Condition | None:
    return None if of is None else Condition(key=of[0], words=of[1])


def refusal(error: TomoskinError) -> SettingRefused:
    """That a setting was refused, with its section and key where the error names them."""
    place = _PLACE.search(error.where)
    section, key, part = place.groups() if place else (None, None, None)
    text = f"{f'{part}: ' if part else ''}{error.advice}" if place else str(error)
    return SettingRefused(section=section, key=key, message=text)


def table_of(name: str, n_electrodes: int) -> PatternTable:
    """The rows of a named pattern.

    Raises
    ------
    PatternError
        For a name that is not known, and more rows than anyone edits one by one.
    """
    pattern = named(name, n_electrodes)
    if pattern.n_meas > MOST_ROWS:
        raise PatternError(
            f"expected a pattern of at most {MOST_ROWS} rows to edit, got {pattern.n_meas}",
            hint="choose it by its name, or begin with a smaller pattern",
        )
    return PatternTable(name=name, drive=pattern.drive.tolist(), measure=pattern.measure.tolist())


def altered(skin: Skin, changes: Changes) -> Skin:
    """``skin`` with ``changes``; keys that go with another choice than is made now are left out.

    Raises
    ------
    SkinError
        For an unknown section or key, one that a page cannot set, or an impossible value.
    """
    for section, key in ((s, k) for s, keys in changes.items() for k in keys):
        if (section, key) in LOCKED:
            raise SkinError(
                "cannot be changed on the page: edit the skin file", where=f"[{section}] {key}"
            )
    return skin.altered({name: _tidy(skin, name, keys) for name, keys in changes.items()})


def _tidy(skin: Skin, name: str, changes: Mapping[str, Any]) -> dict[str, Any]:
    """``changes``, and None for every key that cannot stand beside them and is not among them."""
    if name not in SECTIONS:
        return dict(changes)
    merged = {**skin.document[name], **changes}
    barred = {
        key.name: None
        for key in SECTIONS[name].keys
        if key.name not in changes
        and (
            (key.when and key.when[0] in changes and merged.get(key.when[0]) not in key.when[1])
            or (key.unless and changes.get(key.unless) is not None)
        )
    }
    return {**barred, **changes}


def _form(kind: sections.ValueKind[Any]) -> KindForm:
    form = KindForm(form="text")
    match kind:
        case sections.Choice():
            form = KindForm(form="choice", words=kind.words)
        case sections.Whole() | sections.Number():
            form = KindForm(form="number", low=kind.low, high=kind.high)
        case sections.Quantity():
            form = KindForm(form="quantity", unit=kind.unit, low=kind.low, high=kind.high)
        case sections.NumberOrWord():
            form = replace(_form(kind.number), words=kind.words.words)
        case sections.OneOrMore():
            form = _form(kind.inner)
        case sections.Table():
            names, entries = zip(*kind.row.entries.items(), strict=True)
            form = KindForm(form="rows", names=names, inner=_form(entries[0]))
    return form
