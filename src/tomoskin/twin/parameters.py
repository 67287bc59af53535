"""Numbers of the twin with unit, meaning and source, as docs/twin.md has them; how they wander."""

from __future__ import annotations

import math
from dataclasses import field
from operator import le, lt
from typing import TYPE_CHECKING, Any, TypeVar

from tomoskin.core import FloatArray, ModelError

if TYPE_CHECKING:
    from _typeshed import DataclassInstance


N = TypeVar("N", float, FloatArray)


def parameter(default: Any, unit: str, meaning: str, source: str) -> Any:
    """A field of a settings record that says what it is and where its default comes from."""
    metadata = {"unit": unit, "meaning": meaning, "source": source}
    return field(default=default, metadata=metadata)


def check_numbers(record: DataclassInstance, above: str = "", least: str = "") -> None:
    """Raise ModelError unless the fields named are finite and above 0, or at least 0.

    ``above`` and ``least`` are field names, separated by blanks.
    """
    for names, is_right, expected in ((above, lt, "above 0"), (least, le, "of 0 or more")):
        for name in names.split():
            value = getattr(record, name)
            if not (is_right(0, value) and value < math.inf):
                where = type(record).__name__
                raise ModelError(f"expected {name} {expected}, got {value}", where=where)


def wandered(value: N, sd: float, correlation_time: float, dt: float, chance: N) -> N:
    """Where a ``value`` with a standard deviation of ``sd`` has gone after ``dt`` s.

    Ornstein and Uhlenbeck's process, exact for any step (Gillespie 1996, Phys. Rev. E 54, 2084,
    eq. 2.47); ``chance`` is standard normal.
    """
    kept = math.exp(-dt / correlation_time)
    return kept * value + sd * math.sqrt(1 - kept**2) * chance
