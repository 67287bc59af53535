"""Text logs line by line: whole frames are kept, every other line is counted and listed."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

from tomoskin.core import DataError, check_fits

LONGEST_LINE = 1 << 16
"""Bytes of a line; what follows is a line of its own."""

_LISTED = 8


@dataclass
class Skipped:
    """Lines that no frame was made of: how many for each reason, and the first of them."""

    counts: dict[str, int] = field(default_factory=dict)
    first: dict[str, list[int]] = field(default_factory=dict)

    def add(self, line: int, why: str, lines: int = 1) -> None:
        """Note ``lines`` lines from number ``line`` (from 1) on."""
        self.counts[why] = self.counts.get(why, 0) + lines
        listed = self.first.setdefault(why, [])
        if len(listed) < _LISTED:
            listed.append(line)

    def notes(self) -> tuple[str, ...]:
        """One sentence for each reason."""
        return tuple(
            f"{count} line{'s' if count > 1 else ''} left out, {why}: "
            f"{', '.join(map(str, self.first[why]))}{', …' if count > len(self.first[why]) else ''}"
            for why, count in self.counts.items()
        )


def text_lines(path: Path) -> Iterator[str]:
    """Lines of a file, without their ends; what is no UTF-8 is replaced.

    Raises
    ------
    DataError
        When the file cannot be read or is too large for memory.
    """
    try:
        check_fits(path.stat().st_size, str(path))
        with path.open("rb") as file:
            while line := file.readline(LONGEST_LINE):
                yield _text(line)
    except OSError as error:
        raise DataError(f"cannot be read: {error.strerror or error}", where=str(path)) from error


def bytes_lines(data: bytes) -> Iterator[str]:
    """Lines of bytes that are in memory."""
    return (_text(line) for line in data.split(b"\n"))


def numbers_in(text: str, separator: str = ",") -> list[float] | None:
    """Numbers between separators, an empty one at the end left out; None when one is none."""
    parts = text.strip().rstrip(separator).split(separator)
    try:
        return [float(part) for part in parts]
    except ValueError:
        return None


def _text(line: bytes) -> str:
    return line.rstrip(b"\r\n").decode("utf-8", errors="replace").removeprefix("\ufeff")
