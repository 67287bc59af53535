"""A file of text as lines, one after the other."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from tomoskin.core import check_fits, open_input, read_refusals

LONGEST_LINE = 1 << 16
"""Bytes of a line; what follows is a line of its own."""


def text_lines(path: Path) -> Iterator[str]:
    """Lines of a file, without their ends; what is no UTF-8 is replaced.

    Raises
    ------
    DataError
        When the file cannot be read or is too large for memory.
    """
    with read_refusals(path), open_input(path) as file:
        check_fits(path.stat().st_size, str(path))
        while line := file.readline(LONGEST_LINE):
            yield _text(line)


def bytes_lines(data: bytes) -> Iterator[str]:
    """Lines of bytes that are in memory."""
    return (_text(line) for line in data.split(b"\n"))


def _text(line: bytes) -> str:
    return line.rstrip(b"\r\n").decode("utf-8", errors="replace").removeprefix("\ufeff")
