"""Errors that a person can act on: what was wrong, where, and what to do."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from difflib import get_close_matches
from typing import TypeVar

EMPTY = "is an empty file"
"""What is wrong with such a file, whatever it should hold."""


def meant(given: str, known: Iterable[str]) -> str:
    """A question after the one of the ``known`` words that was probably meant; "" for none."""
    close = get_close_matches(given, list(known), n=1)
    return f'; did you mean "{close[0]}"?' if close else ""


def no_such(given: str, known: Iterable[str], what: str = "", *more: str) -> str:
    """What is wrong with a word that is none of the ``known`` ones, nor of ``more`` kinds."""
    words = list(known)
    expected = f"{what} among {', '.join([*words, *more])}" if what else " or ".join(words)
    return f'expected {expected}, got "{given}"{meant(given, words)}'


def meant_or_known(given: str, known: Iterable[str], what: str = "known") -> str:
    """A hint: the one of the ``known`` words that was probably meant, else all of them."""
    words = list(known)
    return meant(given, words).removeprefix("; ") or f"{what}: {', '.join(words)}"


E = TypeVar("E", bound="TomoskinError")


class TomoskinError(Exception):
    """Base of every error that tomoskin raises on purpose.

    Parameters
    ----------
    message
        What was expected and what was found.
    where
        Where: file, section and key, row, cell, electrode or port.
    hint
        What to do about it.
    """

    def __init__(self, message: str, *, where: str = "", hint: str = "") -> None:
        super().__init__(message)
        self.message = message
        self.where = where
        self.hint = hint

    def __str__(self) -> str:
        """One line: ``where: message (hint)``."""
        return f"{self.where}: {self.advice}" if self.where else self.advice

    @property
    def advice(self) -> str:
        """What is wrong and what to do, where it is clear what of."""
        return f"{self.message} ({self.hint})" if self.hint else self.message

    def within(self, place: str, kind: type[E]) -> E:
        """The same as an error of that ``kind``, of something in ``place``."""
        where = ", ".join(filter(None, (place, self.where)))
        return kind(self.message, where=where, hint=self.hint)


@contextmanager
def located(place: str, kind: type[TomoskinError], *of: type[TomoskinError]) -> Iterator[None]:
    """Within the block errors of the kinds ``of``, by default ``kind`` itself, become errors of
    ``kind`` of something in ``place``."""
    kinds = of or (kind,)
    try:
        yield
    except kinds as error:
        raise error.within(place, kind) from error


class SkinError(TomoskinError):
    """A skin file that cannot be meant: unknown key, wrong unit, impossible value."""


class ScriptError(TomoskinError):
    """A script of the twin that cannot be meant: unknown key, overlapping ids, impossible step."""


class GeometryError(TomoskinError):
    """An outline, electrode placement or mesh that does not describe a sheet."""


class PatternError(TomoskinError):
    """A drive or measurement table that is inconsistent, or rows that cannot be matched."""


class ModelError(TomoskinError):
    """A forward or inverse problem that has no answer as it was put."""


class DataError(TomoskinError):
    """A recording that is empty, damaged, or of another skin."""


class OutputError(DataError):
    """A file that is not written: it would replace what must stay, or its name does not fit."""


class WireError(TomoskinError):
    """A message that cannot be encoded, or a device that speaks another protocol."""


class SourceError(TomoskinError):
    """A source of frames that cannot be opened, or that went away."""


class SinkError(TomoskinError):
    """A sink of results that cannot be opened, or that went away."""


def check_positive(
    value: float, what: str, error: type[TomoskinError] = ModelError, unit: str = ""
) -> None:
    """Raise an ``error`` unless ``value`` is a finite number above 0 of that ``unit``."""
    if not 0 < value < math.inf:
        raise error(f"expected {what} above 0{unit}, got {value}")
