"""A section of a TOML file as a frozen record: each field says what its key may be, and what it
is for. Reading, errors, writing, the page's form and the documentation all follow from that."""

from __future__ import annotations

import inspect
import re
import tomllib
from collections.abc import Iterable, Mapping
from dataclasses import MISSING, dataclass, field, fields, replace
from typing import Any, ClassVar, Self, TypeVar, dataclass_transform

from tomoskin.core import SkinError, meant_or_known
from tomoskin.model.section.kinds import ValueKind, literal, show

T = TypeVar("T")

Document = Mapping[str, Mapping[str, Any]]
"""Sections and their keys as written in the file."""


@dataclass(frozen=True)
class Key:
    """One key of a section.

    Attributes
    ----------
    kind
        What its value may be.
    meaning
        A sentence for the documentation.
    default
        Value, as written, when the key is absent; None where there is none.
    required
        The key must be there, where ``when`` and ``unless`` let it stand at all.
    when
        Another key of the section and the values of it for which this one may stand.
    unless
        Another key of the section that takes this one's place.
    needs
        Another key of the section that must stand beside this one.
    effective
        Another key of the section and the values of it with which this one has an effect; it may
        stand beside others.
    options
        The record that each word of the key stands for. Fields of such a record made by
        :func:`key` are keys of this section too.
    """

    kind: ValueKind[Any]
    meaning: str
    default: str | float | None
    required: bool
    when: tuple[str, tuple[str, ...]] | None
    unless: str
    needs: str
    effective: tuple[str, tuple[str, ...]] | None = None
    options: Mapping[str, Any] | None = None
    name: str = ""

    def conflict(self, given: Mapping[str, object], filled: Mapping[str, object]) -> str:
        """Why the key may not stand in this section, or nothing.

        ``given`` are the section's keys as written, ``filled`` has the defaults before this one.
        """
        if self.unless and self.unless in given:
            return f"cannot be combined with {self.unless}"
        if self.when:
            other, allowed = self.when
            if filled.get(other) not in allowed:
                kinds = " or ".join(f'"{value}"' for value in allowed)
                return f"needs {other} = {kinds}, got {other} = {show(filled.get(other))}"
        return ""

    def is_idle(self, filled: Mapping[str, object]) -> bool:
        """Whether it has its default in a section where it has no effect."""
        other, words = self.effective or ("", ())
        return bool(other) and filled.get(other) not in words and filled[self.name] == self.default

    def read(self, value: object, where: str) -> Any:
        """``value`` in SI units; SkinError that names the key."""
        try:
            return self.kind.read(value)
        except ValueError as error:
            raise SkinError(str(error), where=f"{where} {self.name}") from None


def key(
    kind: ValueKind[T],
    meaning: str,
    /,
    *,
    default: Any = MISSING,
    unless: str = "",
    needs: str = "",
    effective: tuple[str, tuple[str, ...]] | None = None,
    options: Mapping[str, Any] | None = None,
    **when: str | tuple[str, ...],
) -> T:
    """A field of a :class:`Section`; without ``default`` (None: none at all) the key is required.

    ``when`` names another key and its values for which this one may stand: ``shape="disc"``;
    ``effective`` those for which it does anything. With ``options`` its words name records, see
    :class:`Key`. In the record a key that is absent has its
    default in SI units, or None.
    """
    condition = None
    for other, words in when.items():
        condition = other, (words,) if isinstance(words, str) else words
    written = None if default is MISSING else default
    required = default is MISSING
    declared = Key(kind, meaning, written, required, condition, unless, needs, effective, options)
    metadata = {"key": declared}
    if declared.required and not (when or unless):
        return field(metadata=metadata)  # type: ignore[no-any-return]
    try:
        value: Any = None if written is None else kind.read(written)
    except ValueError as error:
        raise ValueError(f'default of "{meaning}": {error}') from None
    return field(default=value, metadata=metadata)  # type: ignore[no-any-return]


@dataclass_transform(frozen_default=True, kw_only_default=True, field_specifiers=(key,))
class Section:
    """Base of the sections: ``class Outline(Section, section="outline")``, its docstring what the
    section is, its fields made by :func:`key`. ``many``: a list of tables."""

    section: ClassVar[str]
    heading: ClassVar[str]
    meaning: ClassVar[str]
    keys: ClassVar[tuple[Key, ...]]

    def __init_subclass__(cls, section: str = "", *, many: bool = False) -> None:
        """Make the record, and list its keys."""
        _add_parameters(cls)
        dataclass(frozen=True, kw_only=True)(cls)
        cls.meaning = " ".join(inspect.cleandoc(cls.__doc__ or "").split())
        cls.keys = tuple(
            replace(one.metadata["key"], name=one.name)
            for one in fields(cls)  # type: ignore[arg-type]
        )
        if section:
            cls.section, cls.heading = section, f"[[{section}]]" if many else f"[{section}]"

    @classmethod
    def complete(cls, given: object, where: str) -> dict[str, Any]:
        """``given`` keys as written, defaults filled in; SkinError for a key that may not stand."""
        if not isinstance(given, Mapping):
            raise SkinError(
                f"expected a section, got {show(given)}",
                where=where,
                hint=f"write {cls.heading} on a line of its own",
            )
        check_names(given, [key.name for key in cls.keys], "key", where)
        filled: dict[str, Any] = {}
        for key in cls.keys:
            place, conflict = f"{where} {key.name}", key.conflict(given, filled)
            if key.name in given:
                if conflict:
                    cls._check_cause(key, filled, where)
                    raise SkinError(
                        conflict, where=place, hint="remove this key, or change the other one"
                    )
                if key.needs and key.needs not in given:
                    raise SkinError(f"needs the key {key.needs} as well", where=place)
                filled[key.name] = given[key.name]
            elif key.required and not conflict:
                raise SkinError(f"is missing; expected {key.kind.expected}", where=place)
            elif key.default is not None and not conflict:
                filled[key.name] = key.default
        return filled

    @classmethod
    def _check_cause(cls, refused: Key, filled: Mapping[str, Any], where: str) -> None:
        """Raise SkinError where a key may not stand because another one's value is none at all."""
        for key in cls.keys:
            if refused.when and key.name == refused.when[0] and key.name in filled:
                key.read(filled[key.name], where)

    @classmethod
    def read(cls, given: object, where: str) -> Self:
        """The record in SI units; ``where`` names the section in errors.

        Raises SkinError that names the key.
        """
        written = cls.complete(given, where)
        return cls(
            **{k.name: k.read(written[k.name], where) for k in cls.keys if k.name in written}
        )

    @classmethod
    def each(cls, tables: Mapping[str, Any], source: str) -> list[tuple[Self, str]]:
        """The record of each table of a list, and where that stands; SkinError as :meth:`read`."""
        given = tables.get(cls.section, [])
        if not isinstance(given, list):
            raise SkinError(
                f"expected a list of tables, got {show(given)}",
                where=f"{source}: [{cls.section}]",
                hint=f"write {cls.heading}, because there may be several",
            )
        records = []
        for number, table in enumerate(given, start=1):
            named = table if isinstance(table, Mapping) else {}
            title = named.get("id", named.get("name"))
            name = f' "{title}"' if isinstance(title, str) else ""
            where = f"{source}: {cls.heading} {number}{name}"
            records.append((cls.read(table, where), where))
        return records

    def record(self, name: str) -> Any:
        """The record that the word of the key ``name`` stands for, with its parameters."""
        options = next(key.options for key in self.keys if key.name == name)
        chosen = (options or {})[getattr(self, name)]
        own = [one.name for one in fields(chosen) if "key" in one.metadata]
        return replace(chosen, **{parameter: getattr(self, parameter) for parameter in own})


def _add_parameters(cls: type[Section]) -> None:
    """Give the section the keys of its options, each after the key whose word has them."""
    annotations = {}
    for name, annotation in cls.__annotations__.items():
        annotations[name] = annotation
        declared = getattr(vars(cls).get(name), "metadata", {}).get("key")
        if declared is None or declared.options is None:
            continue
        for parameter, (default, words, own) in _parameters(declared.options).items():
            if parameter in cls.__annotations__:
                raise TypeError(
                    f"{', '.join(words)}: {parameter} is a key of {cls.__name__} already"
                )
            of = own
            if own.when is None:
                of = replace(own, when=declared.when, effective=(name, words))
            setattr(cls, parameter, field(default=default, metadata={"key": of}))
            annotations[parameter] = "Any"
    cls.__annotations__ = annotations


def _parameters(options: Mapping[str, Any]) -> dict[str, tuple[Any, tuple[str, ...], Key]]:
    """Default, words and declaration of each key that a record among ``options`` has."""
    merged: dict[str, tuple[Any, tuple[str, ...], Key]] = {}
    for word, record in options.items():
        for one in fields(record):
            if "key" in one.metadata:
                _, words, own = merged.get(one.name, (None, (), one.metadata["key"]))
                if own != one.metadata["key"]:
                    raise TypeError(f"{word} and {words[0]} declare {one.name} differently")
                merged[one.name] = one.default, (*words, word), own
    return merged


_COMMA = re.compile(r"=\s*[-+]?\d+,\d+\s*$", re.MULTILINE)


_LINE = re.compile(r"\(at line (\d+), column \d+\)$")
_KEY = re.compile(r"\s*(?P<heading>\[.*)|\s*(?P<key>[\w.-]+)\s*=")


def _key_near(text: str, error: str) -> str:
    """Section and key at the line that a parser's ``error`` names, or before it; "" for none."""
    line = _LINE.search(error)
    number = int(line[1]) if line else None
    heading = key = ""
    for match in filter(None, map(_KEY.match, text.splitlines()[:number])):
        heading, key = (
            (match["heading"].strip(), "") if match["heading"] else (heading, match["key"])
        )
    return f" near {f'{heading} {key}'.strip()}" if heading or key else ""


def toml_tables(text: str, source: str, version: int, sections: Iterable[str]) -> dict[str, Any]:
    """Tables of a TOML file whose first key is ``format = version``, as written.

    Raises SkinError that names ``source``, also for a table that is none of the ``sections``.
    """
    try:
        tables = tomllib.loads(text)
    except (ValueError, RecursionError) as error:  # also numbers or nesting beyond all bounds
        hint = "numbers need a decimal point, not a comma" if _COMMA.search(text) else ""
        near = _key_near(text, str(error))
        raise SkinError(f"is not valid TOML{near}: {error}", where=source, hint=hint) from None
    where = f"{source}: format"
    if "format" not in tables:
        raise SkinError(
            "is missing", where=where, hint=f"begin the file with the line format = {version}"
        )
    given = tables.pop("format")
    if given != version or isinstance(given, bool):
        raise SkinError(
            f"expected {version}, got {show(given)}",
            where=where,
            hint=f"this tomoskin reads files of format {version}",
        )
    check_names(tables, list(sections), "section", source)
    return tables


def toml_text(document: Document, sections: Iterable[type[Section]], version: int) -> str:
    """Text of a TOML file with the keys of ``document``, in the order of their declaration, but
    for those that have no effect there and stand at their defaults."""
    lines = [f"format = {version}"]
    for section in sections:
        keys = document[section.section]
        shown = [k.name for k in section.keys if k.name in keys and not k.is_idle(keys)]
        lines += ["", section.heading, *(f"{name} = {literal(keys[name])}" for name in shown)]
    return "\n".join(lines) + "\n"


def check_names(given: Iterable[str], known: list[str], what: str, where: str) -> None:
    """Raise SkinError for a name that is not ``known``, with the one that may have been meant."""
    for name in given:
        if name not in known:
            hint = meant_or_known(name, known)
            raise SkinError(f'unknown {what} "{name}"', where=where, hint=hint)
