"""One line of the table of all."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Line:
    """What was measured here, what was promised of it, and what others take for the same."""

    what: str
    unit: str
    value: float | None
    promised: str = ""
    scipy: float | None = None
    peer: float | None = None
