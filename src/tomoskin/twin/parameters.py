"""Numbers of the twin with their unit, meaning and source: docs/twin.md is made from them."""

from __future__ import annotations

import math
from dataclasses import field
from typing import TYPE_CHECKING, Any

from tomoskin.core import ModelError

if TYPE_CHECKING:
    from _typeshed import DataclassInstance


def parameter(default: Any, unit: str, meaning: str, source: str) -> Any:
    """A field of a settings record that says what it is and where its default comes from."""
    metadata = {"unit": unit, "meaning": meaning, "source": source}
    return field(default=default, metadata=metadata)


def check_numbers(record: DataclassInstance, above: str = "", least: str = "") -> None:
    """Raise ModelError unless the fields named are finite and above 0, or at least 0.

    ``above`` and ``least`` are field names, separated by blanks.
    """
    where = type(record).__name__
    for name in above.split():
        value = getattr(record, name)
        if not 0 < value < math.inf:
            raise ModelError(f"expected {name} above 0, got {value}", where=where)
    for name in least.split():
        value = getattr(record, name)
        if not 0 <= value < math.inf:
            raise ModelError(f"expected {name} of 0 or more, got {value}", where=where)
