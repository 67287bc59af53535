"""One line of the table of all."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Line:
    """What was measured here, what was promised of it, and what others take for the same."""

    what: str
    unit: str
    value: float | str | None
    """In words where it is more than one number."""

    promised: str = ""
    scipy: float | None = None
    peer: float | None = None
