"""The skin's schema and document as messages, from which a page makes its forms."""

from __future__ import annotations

import re
from collections.abc import Mapping
from functools import cache
from typing import Any

from msgspec.structs import replace

from tomoskin.core import PatternError, SkinError, TomoskinError
from tomoskin.model.pattern import named
from tomoskin.model.section import (
    Choice,
    Number,
    NumberOrWord,
    OneOrEach,
    Quantity,
    Table,
    ValueKind,
    Whole,
)
from tomoskin.model.skin import SECTIONS, Skin
from tomoskin.server.settings_messages import (
    Condition,
    KeyForm,
    KindForm,
    PatternTable,
    SchemaForm,
    SectionForm,
    SettingRefused,
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
    advice = f" ({error.hint})" if error.hint else ""
    text = f"{f'{part}: ' if part else ''}{error.message}{advice}" if place else str(error)
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


def _form(kind: ValueKind[Any]) -> KindForm:
    form = KindForm(form="text")
    match kind:
        case Choice():
            form = KindForm(form="choice", words=kind.words)
        case Whole() | Number():
            form = KindForm(form="number", low=kind.low, high=kind.high)
        case Quantity():
            form = KindForm(form="quantity", unit=kind.unit, low=kind.low, high=kind.high)
        case NumberOrWord():
            form = replace(_form(kind.number), words=kind.words.words)
        case OneOrEach():
            form = _form(kind.inner)
        case Table():
            names, kinds = zip(*kind.row.entries.items(), strict=True)
            form = KindForm(form="rows", names=names, inner=_form(kinds[0]))
    return form
