"""Values of a script that a skin file does not have: places, courses in time, ranges, words."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from tomoskin.skin import Kind, read_entry, show


@dataclass(frozen=True)
class Row(Kind):
    """A list of fixed length, each entry of its own kind; comes back as a tuple."""

    names: tuple[str, ...]
    kinds: tuple[Kind, ...]

    @property
    def expected(self) -> str:
        """The phrase."""
        entries = ", ".join(
            f"{name}: {kind.expected}" for name, kind in zip(self.names, self.kinds, strict=True)
        )
        return f"[{', '.join(self.names)}] ({entries})"

    def read(self, value: object) -> tuple[Any, ...]:
        """The entries."""
        if not isinstance(value, list) or len(value) != len(self.kinds):
            raise ValueError(f"expected {self.expected}, got {show(value)}")
        entries = zip(self.names, self.kinds, value, strict=True)
        return tuple(read_entry(name, kind, item) for name, kind, item in entries)


@dataclass(frozen=True)
class Listed(Kind):
    """A list of at least so many rows; comes back as a tuple."""

    row: Row
    least: int

    @property
    def expected(self) -> str:
        """The phrase."""
        return f"a list of at least {self.least} rows {self.row.expected}"

    def read(self, value: object) -> tuple[tuple[Any, ...], ...]:
        """The rows."""
        if not isinstance(value, list) or len(value) < self.least:
            raise ValueError(f"expected {self.expected}, got {show(value)}")
        return tuple(read_entry(f"row {i}", self.row, item) for i, item in enumerate(value))


@dataclass(frozen=True)
class Course(Kind):
    """Rows that begin with a time, in ascending order: a course with straight lines between."""

    row: Row

    @property
    def expected(self) -> str:
        """The phrase."""
        return f"a list of rows {self.row.expected}, in the order of their times"

    def read(self, value: object) -> tuple[tuple[Any, ...], ...]:
        """The rows."""
        rows = Listed(self.row, 1).read(value)
        for i in range(1, len(rows)):
            if not rows[i][0] > rows[i - 1][0]:
                raise ValueError(
                    f"row {i}: expected a time after {rows[i - 1][0]:g} s, got {rows[i][0]:g} s"
                )
        return rows


@dataclass(frozen=True)
class Span(Kind):
    """One value, or ``[low, high]`` to draw from; comes back as (low, high)."""

    inner: Kind

    @property
    def expected(self) -> str:
        """The phrase."""
        return f"{self.inner.expected}, or a pair [low, high] of these"

    def read(self, value: object) -> tuple[Any, Any]:
        """Low and high; the same for one value."""
        if not isinstance(value, list):
            one = self.inner.read(value)
            return one, one
        low, high = Row(("low", "high"), (self.inner, self.inner)).read(value)
        if low > high:
            raise ValueError(f"expected low before high, got {show(value)}")
        return low, high


@dataclass(frozen=True)
class Words(Kind):
    """One word out of a few, or a list of different ones; comes back as a tuple."""

    words: tuple[str, ...]

    @property
    def expected(self) -> str:
        """The phrase."""
        words = " or ".join(f'"{word}"' for word in self.words)
        return f"{words}, or a list of different ones"

    def read(self, value: object) -> tuple[str, ...]:
        """The words."""
        given = value if isinstance(value, list) else [value]
        known = [word for word in given if isinstance(word, str) and word in self.words]
        if not given or len(set(known)) < len(given):
            raise ValueError(f"expected {self.expected}, got {show(value)}")
        return tuple(known)
