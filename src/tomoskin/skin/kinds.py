"""What a value in a skin file may be: read it, or say what was expected."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Protocol

from tomoskin.core import DIMENSIONS, parse_quantity


class Kind(Protocol):
    """One sort of value; ``expected`` is the phrase that errors and the documentation use."""

    @property
    @abstractmethod
    def expected(self) -> str:
        """What a value must be, range included."""

    @abstractmethod
    def read(self, value: object) -> Any:
        """``value`` in SI units, or ValueError with what was expected and found."""


@dataclass(frozen=True)
class Text(Kind):
    """Any text."""

    @property
    def expected(self) -> str:
        """The phrase."""
        return "text"

    def read(self, value: object) -> str:
        """The text."""
        if not isinstance(value, str):
            raise _unexpected(self, value)
        return value


@dataclass(frozen=True)
class Name(Kind):
    """A short text on one line, as long as the name of a file may be."""

    most: int = 255

    @property
    def expected(self) -> str:
        """The phrase."""
        return f"text of 1 to {self.most} characters on one line"

    def read(self, value: object) -> str:
        """The text."""
        if not isinstance(value, str) or not value.strip():
            raise _unexpected(self, value)
        if len(value) > self.most or not value.isprintable():
            raise _unexpected(self, value)
        return value


@dataclass(frozen=True)
class Choice(Kind):
    """One of a few words."""

    words: tuple[str, ...]

    @property
    def expected(self) -> str:
        """The phrase."""
        return " or ".join(f'"{word}"' for word in self.words)

    def read(self, value: object) -> str:
        """The word."""
        if not isinstance(value, str) or value not in self.words:
            raise _unexpected(self, value)
        return value


@dataclass(frozen=True)
class Whole(Kind):
    """A whole number in a range."""

    low: int
    high: int

    @property
    def expected(self) -> str:
        """The phrase."""
        return f"a whole number from {self.low} to {self.high}"

    def read(self, value: object) -> int:
        """The number."""
        if isinstance(value, bool) or not isinstance(value, int):
            raise _unexpected(self, value)
        if not self.low <= value <= self.high:
            raise _unexpected(self, value)
        return value


@dataclass(frozen=True)
class Number(Kind):
    """A number without unit in a range."""

    low: float
    high: float

    @property
    def expected(self) -> str:
        """The phrase."""
        return f"a number from {self.low:g} to {self.high:g}"

    def read(self, value: object) -> float:
        """The number."""
        if isinstance(value, bool) or not isinstance(value, int | float):
            raise _unexpected(self, value)
        if not self.low <= value <= self.high:  # NaN fails too
            raise _unexpected(self, value)
        return float(value)


@dataclass(frozen=True)
class NumberOrWord(Kind):
    """A number in a range, or one of a few words in its place."""

    number: Number
    words: Choice

    @property
    def expected(self) -> str:
        """The phrase."""
        return f"{self.number.expected}, or {self.words.expected}"

    def read(self, value: object) -> float | str:
        """The number or the word."""
        kind: Kind = self.words if isinstance(value, str) else self.number
        try:
            found: float | str = kind.read(value)
        except ValueError:
            raise _unexpected(self, value) from None
        return found


@dataclass(frozen=True)
class Quantity(Kind):
    """A number with a unit; the range is stated in ``unit``, the value comes back in SI."""

    dimension: str
    unit: str
    low: float
    high: float

    @property
    def expected(self) -> str:
        """The phrase."""
        article = "an" if self.dimension[0] in "aeiou" else "a"
        return f"{article} {self.dimension} from {self.low:g} to {self.high:g} {self.unit}"

    def read(self, value: object) -> float:
        """The quantity in SI units."""
        if isinstance(value, int | float) and not isinstance(value, bool):
            number = show(value)
            example = f'"{number} {self.unit}"'
            raise ValueError(f"expected {self.expected}, got {number} without a unit; {example}?")
        if not isinstance(value, str):
            raise _unexpected(self, value)
        result = parse_quantity(value, self.dimension)
        size = DIMENSIONS[self.dimension][self.unit]
        low, high = (end * size for end in (self.low, self.high))
        if not low - 1e-12 * abs(low) <= result <= high + 1e-12 * abs(high):  # NaN fails too
            raise _unexpected(self, value)
        return result


@dataclass(frozen=True)
class OneOrEach(Kind):
    """One value for all electrodes, or a list with one for each; comes back as a tuple."""

    inner: Kind

    @property
    def expected(self) -> str:
        """The phrase."""
        return f"{self.inner.expected}, or a list of these, one per electrode"

    def read(self, value: object) -> tuple[Any, ...]:
        """A tuple: of one, or of one per electrode."""
        if not isinstance(value, list):
            return (self.inner.read(value),)
        return tuple(read_entry(f"entry {i}", self.inner, item) for i, item in enumerate(value))


@dataclass(frozen=True)
class Rows(Kind):
    """A list of pairs, such as ``[["0 mm", "5 mm"], …]`` or ``[[1, 0], …]``."""

    inner: Kind
    names: tuple[str, str]
    least: int

    @property
    def expected(self) -> str:
        """The phrase."""
        pair = ", ".join(self.names)
        return f"a list of at least {self.least} pairs [{pair}], each {self.inner.expected}"

    def read(self, value: object) -> tuple[tuple[Any, Any], ...]:
        """The pairs."""
        if not isinstance(value, list) or len(value) < self.least:
            raise _unexpected(self, value)
        return tuple(self._pair(i, row) for i, row in enumerate(value))

    def _pair(self, i: int, row: object) -> tuple[Any, Any]:
        if not isinstance(row, list) or len(row) != 2:
            raise ValueError(f"row {i}: expected a pair [{', '.join(self.names)}], got {show(row)}")
        first, second = (
            read_entry(f"row {i}, {name}", self.inner, item)
            for name, item in zip(self.names, row, strict=True)
        )
        return first, second


def show(value: object) -> str:
    """``value`` as it may stand in a TOML file, cut to a readable length."""
    text = literal(value)
    return text if len(text) <= 60 else f"{text[:57]}…"


def literal(value: object) -> str:
    """``value`` as TOML."""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str):
        return f'"{"".join(_ESCAPES.get(c, c) for c in value)}"'
    if isinstance(value, Sequence):
        return f"[{', '.join(literal(item) for item in value)}]"
    return str(value)


_ESCAPES = {chr(code): f"\\u{code:04X}" for code in [*range(32), 127]}
_ESCAPES |= {'"': '\\"', "\\": "\\\\", "\n": "\\n", "\t": "\\t"}


def read_entry(place: str, kind: Kind, value: object) -> Any:
    """``value`` as ``kind`` reads it; ValueError that names its ``place`` in a list."""
    try:
        return kind.read(value)
    except ValueError as error:
        raise ValueError(f"{place}: {error}") from None


def _unexpected(kind: Kind, value: object) -> ValueError:
    return ValueError(f"expected {kind.expected}, got {show(value)}")
