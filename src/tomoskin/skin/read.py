"""TOML text → values in SI, checked against the schema key by key."""

from __future__ import annotations

import tomllib
from collections.abc import Iterable, Mapping
from difflib import get_close_matches
from typing import Any

from tomoskin.core import SkinError
from tomoskin.skin.kinds import show
from tomoskin.skin.schema import FORMAT, SECTIONS, Key, Section

Document = Mapping[str, Mapping[str, Any]]
"""Sections and their keys: as written in the file, or as values in SI."""


def parse(text: str, source: str) -> Document:
    """Sections of a skin file as written, known keys only, defaults filled in.

    Raises SkinError that names ``source``, section and key.
    """
    return complete(toml_tables(text, source, FORMAT), source)


def toml_tables(text: str, source: str, version: int) -> dict[str, Any]:
    """Tables of a TOML file whose first key is ``format = version``, as written.

    Raises SkinError that names ``source``.
    """
    try:
        raw = tomllib.loads(text)
    except (ValueError, RecursionError) as error:  # also numbers or nesting beyond all bounds
        raise SkinError(f"is not valid TOML: {error}", where=source) from None
    _check_format(raw, source, version)
    return {name: raw[name] for name in raw if name != "format"}


def complete(raw: Mapping[str, object], source: str) -> Document:
    """``raw`` with every known section, defaults filled in; unknown names are errors."""
    check_names(raw, [section.name for section in SECTIONS], "section", source)
    return {
        section.name: complete_section(
            section, raw.get(section.name, {}), f"{source}: {section.heading}"
        )
        for section in SECTIONS
    }


def values(document: Document, source: str) -> Document:
    """The document's values in SI units."""
    return {
        section.name: section_values(
            section, document[section.name], f"{source}: {section.heading}"
        )
        for section in SECTIONS
    }


def read_section(section: Section, given: object, where: str) -> dict[str, Any]:
    """Values of one section in SI units, defaults filled in; ``where`` names it in errors.

    Raises SkinError that names the key.
    """
    return section_values(section, complete_section(section, given, where), where)


def _check_format(raw: Mapping[str, object], source: str, version: int) -> None:
    where = f"{source}: format"
    if "format" not in raw:
        raise SkinError("is missing", where=where, hint=f"begin the file with format = {version}")
    if raw["format"] != version or isinstance(raw["format"], bool):
        raise SkinError(f"expected {version}, got {show(raw['format'])}", where=where)


def complete_section(section: Section, given: object, where: str) -> dict[str, Any]:
    """``given`` keys as written, defaults filled in; SkinError for a key that may not stand."""
    if not isinstance(given, Mapping):
        raise SkinError(
            f"expected a section, got {show(given)}",
            where=where,
            hint=f"write {section.heading} on a line of its own",
        )
    check_names(given, [key.name for key in section.keys], "key", where)
    filled: dict[str, Any] = {}
    for key in section.keys:
        barred = _barred(key, given, filled)
        if key.name in given:
            if barred:
                raise SkinError(barred, where=f"{where} {key.name}", hint="leave one of them out")
            if key.needs and key.needs not in given:
                raise SkinError(f"needs {key.needs} beside it", where=f"{where} {key.name}")
            filled[key.name] = given[key.name]
        elif key.default is not None and not barred:
            filled[key.name] = key.default
        elif key.required and not barred:
            raise SkinError(
                f"is missing; expected {key.kind.expected}", where=f"{where} {key.name}"
            )
    return filled


def _barred(key: Key, given: Mapping[str, object], filled: Mapping[str, object]) -> str:
    """Why the key may not stand in this section, or nothing."""
    if key.unless and key.unless in given:
        return f"cannot stand beside {key.unless}"
    if key.when:
        other, allowed = key.when
        if filled.get(other) not in allowed:
            kinds = " or ".join(f'"{value}"' for value in allowed)
            return f"goes with {other} = {kinds}, got {other} = {show(filled.get(other))}"
    return ""


def check_names(given: Iterable[str], known: list[str], what: str, where: str) -> None:
    """Raise SkinError for a name that is not known, with the one that may have been meant."""
    for name in given:
        if name not in known:
            close = get_close_matches(name, known, n=1)
            guess = f'did you mean "{close[0]}"?' if close else f"known: {', '.join(known)}"
            raise SkinError(f'unknown {what} "{name}"', where=where, hint=guess)


def section_values(section: Section, filled: Mapping[str, Any], where: str) -> dict[str, Any]:
    """The section's values in SI units."""
    return {
        key.name: _read(key, filled[key.name], f"{where} {key.name}")
        for key in section.keys
        if key.name in filled
    }


def _read(key: Key, value: object, place: str) -> Any:
    try:
        return key.kind.read(value)
    except ValueError as error:
        raise SkinError(str(error), where=place) from None
