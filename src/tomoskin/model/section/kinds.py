"""What a value in a TOML file may be: read it in SI units, or say what was expected."""

from __future__ import annotations

import json
from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Generic, TypeVar

from tomoskin.core import DIMENSIONS, meant, parse_quantity

T_co = TypeVar("T_co", covariant=True)


class ValueKind(ABC, Generic[T_co]):
    """One sort of value; ``expected`` is the phrase that errors and the documentation use."""

    @property
    @abstractmethod
    def expected(self) -> str:
        """What a value must be, range included."""

    @abstractmethod
    def accept(self, value: object) -> T_co | None:
        """``value`` in SI units; None, or ValueError with a finer reason, where it is another."""

    def read(self, value: object) -> T_co:
        """``value`` in SI units. Raises ValueError with what was expected and what is there."""
        accepted = self.accept(value)
        if accepted is None:
            raise ValueError(f"expected {self.expected}, got {show(value)}{self.guess(value)}")
        return accepted

    def guess(self, value: object) -> str:  # noqa: ARG002
        """A question after what was probably meant; "" where nobody can know."""
        return ""


@dataclass(frozen=True)
class Text(ValueKind[str]):
    """Any text; with ``most``, a short one on one line that is not blank."""

    most: int | None = None

    @property
    def expected(self) -> str:
        """What a value must be, for messages."""
        if self.most is None:
            return "text"
        return f"text of 1 to {self.most} characters on one line"

    def accept(self, value: object) -> str | None:
        """The text, or None where the value is none."""
        if not isinstance(value, str):
            return None
        if self.most is None:
            return value
        fits = bool(value.strip()) and len(value) <= self.most and value.isprintable()
        return value if fits else None


@dataclass(frozen=True)
class Choice(ValueKind[str]):
    """A value that is one of a few words."""

    words: tuple[str, ...]

    @property
    def expected(self) -> str:
        """What a value must be, for messages."""
        return " or ".join(f'"{word}"' for word in self.words)

    def accept(self, value: object) -> str | None:
        """The word, or None where the value is none of them."""
        return value if isinstance(value, str) and value in self.words else None

    def guess(self, value: object) -> str:
        """The word that is like it, as a question."""
        return meant(value, self.words) if isinstance(value, str) else ""


@dataclass(frozen=True)
class Whole(ValueKind[int]):
    """A value that is a whole number in a range."""

    low: int
    high: int

    @property
    def expected(self) -> str:
        """What a value must be, for messages."""
        return f"a whole number from {self.low} to {self.high}"

    def accept(self, value: object) -> int | None:
        """The number, or None where the value is none."""
        if isinstance(value, bool) or not isinstance(value, int):
            return None
        return value if self.low <= value <= self.high else None


@dataclass(frozen=True)
class Number(ValueKind[float]):
    """A number without unit in a range."""

    low: float
    high: float

    @property
    def expected(self) -> str:
        """What a value must be, for messages."""
        return f"a number from {self.low:g} to {self.high:g}"

    def accept(self, value: object) -> float | None:
        """The number, or None; NaN is not accepted."""
        if isinstance(value, bool) or not isinstance(value, int | float):
            return None
        return float(value) if self.low <= value <= self.high else None


@dataclass(frozen=True)
class NumberOrWord(ValueKind[float | str]):
    """A number in a range, or one of a few words in its place."""

    number: Number
    words: Choice

    @property
    def expected(self) -> str:
        """What a value must be, for messages."""
        return f"{self.number.expected}, or {self.words.expected}"

    def accept(self, value: object) -> float | str | None:
        """The number or the word, or None where the value is neither."""
        return self.words.accept(value) or self.number.accept(value)


@dataclass(frozen=True)
class Quantity(ValueKind[float]):
    """A number with a unit; the range is stated in ``unit``, the value comes back in SI."""

    dimension: str
    unit: str
    low: float
    high: float

    @property
    def expected(self) -> str:
        """What a value must be, for messages."""
        article = "an" if self.dimension[0] in "aeiou" else "a"
        return f"{article} {self.dimension} from {self.low:g} to {self.high:g} {self.unit}"

    def accept(self, value: object) -> float | None:
        """The quantity in SI units; NaN is none."""
        if isinstance(value, int | float) and not isinstance(value, bool):
            example = f'"{show(value)} {self.unit}"'
            raise ValueError(
                f"expected {self.expected}, got {show(value)} without a unit; write it as {example}"
            )
        if not isinstance(value, str):
            return None
        result = parse_quantity(value, self.dimension)
        size = DIMENSIONS[self.dimension][self.unit]
        low, high = (end * size for end in (self.low, self.high))
        fits = low - 1e-12 * abs(low) <= result <= high + 1e-12 * abs(high)
        return result if fits else None


@dataclass(frozen=True)
class OneOrMore(ValueKind[tuple[Any, ...]]):
    """One value, or a list; comes back as a tuple.

    ``note``: what more is said of the list. ``different``: it holds one at least, and none twice.
    """

    inner: ValueKind[Any]
    note: str = ""
    different: bool = False

    @property
    def expected(self) -> str:
        """What a value must be, for messages."""
        these = "different ones" if self.different else "these"
        return f"{self.inner.expected}, or a list of {these}{self.note}"

    def accept(self, value: object) -> tuple[Any, ...] | None:
        """A tuple, of one for one value; None where there are not as many as there should be."""
        if not isinstance(value, list):
            return (self.inner.read(value),)
        values = tuple(_entry(f"entry {i}", self.inner, item) for i, item in enumerate(value))
        return None if self.different and not 0 < len(set(values)) == len(values) else values


@dataclass(frozen=True)
class OneOrSpan(ValueKind[tuple[Any, Any]]):
    """One value, or ``[low, high]`` to draw from; comes back as (low, high)."""

    inner: ValueKind[Any]

    @property
    def expected(self) -> str:
        """What a value must be, for messages."""
        return f"{self.inner.expected}, or a pair [low, high] of these"

    def accept(self, value: object) -> tuple[Any, Any]:
        """Low and high; the same for one value."""
        if not isinstance(value, list):
            one = self.inner.read(value)
            return one, one
        low, high = Row({"low": self.inner, "high": self.inner}).read(value)
        if low > high:
            raise ValueError(f"expected low before high, got {show(value)}")
        return low, high


@dataclass(frozen=True)
class Row(ValueKind[tuple[Any, ...]]):
    """A list of fixed length, each entry with a name and a kind; comes back as a tuple."""

    entries: Mapping[str, ValueKind[Any]]

    @property
    def noun(self) -> str:
        """What it is called: a pair holds two of one kind."""
        return "pair" if len(self.entries) == 2 and self._same else "row"

    @property
    def layout(self) -> str:
        """Names of the entries, and what each is."""
        names = f"[{', '.join(self.entries)}]"
        if self._same:
            return f"{names}, each {next(iter(self.entries.values())).expected}"
        kinds = ", ".join(f"{name}: {kind.expected}" for name, kind in self.entries.items())
        return f"{names} ({kinds})"

    @property
    def expected(self) -> str:
        """What a value must be, for messages."""
        return f"a {self.noun} {self.layout}"

    def accept(self, value: object) -> tuple[Any, ...] | None:
        """The entries, or None where one does not fit."""
        if not isinstance(value, list) or len(value) != len(self.entries):
            return None
        entries = zip(self.entries.items(), value, strict=True)
        return tuple(_entry(name, kind, item) for (name, kind), item in entries)

    @property
    def _same(self) -> bool:
        first, *others = self.entries.values()
        return all(other == first for other in others)


@dataclass(frozen=True)
class Table(ValueKind[tuple[tuple[Any, ...], ...]]):
    """A list of at least so many rows; comes back as a tuple. ``ascending``: by their first entry,
    a time, as a course with straight lines between has them."""

    row: Row
    least: int = 1
    ascending: bool = False

    @property
    def expected(self) -> str:
        """What a value must be, for messages."""
        if self.ascending:
            return f"a list of {self.row.noun}s {self.row.layout}, in the order of their times"
        return f"a list of at least {self.least} {self.row.noun}s {self.row.layout}"

    def accept(self, value: object) -> tuple[tuple[Any, ...], ...] | None:
        """The rows, or None where one does not fit."""
        if not isinstance(value, list) or len(value) < self.least:
            return None
        rows = tuple(_entry(f"row {i}", self.row, item) for i, item in enumerate(value))
        for i in range(1, len(rows) if self.ascending else 0):
            before, time = rows[i - 1][0], rows[i][0]
            if not time > before:
                raise ValueError(f"row {i}: expected a time after {before:g} s, got {time:g} s")
        return rows


def show(value: object) -> str:
    """``value`` as it may stand in a TOML file, cut to a readable length."""
    text = literal(value)
    return text if len(text) <= 60 else f"{text[:57]}…"


def literal(value: object) -> str:
    """The ``value`` as TOML writes it; its texts are those of JSON but for one character."""
    if isinstance(value, bool | str):
        return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007F")
    if isinstance(value, Sequence):
        return f"[{', '.join(literal(item) for item in value)}]"
    return str(value)


class _EntryError(ValueError):
    """What is wrong with an entry of a list, after its place there."""


def _entry(place: str, kind: ValueKind[Any], value: object) -> Any:
    """``value`` as ``kind`` reads it; an error names its ``place`` in a list, or in several."""
    try:
        return kind.read(value)
    except _EntryError as error:
        raise _EntryError(f"{place}, {error}") from None
    except ValueError as error:
        raise _EntryError(f"{place}: {error}") from None
