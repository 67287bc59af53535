"""How a sheet is deformed, as it leaves the program: as a document, as columns, and as spans."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from tomoskin.sensing.fit import Deformation, EstimatedNumber

_NUMBERS = {"axis": "rad", "offset": "m", "width": "m", "amount": "", "across": ""}
"""Numbers of a deformation by the names of their fields, each with its unit; "": that of ``unit``,
which each deformation says."""

_PARTS = ("value", "low", "high")

DEFORMATION_KINDS = ("none", "fold", "stretch", "common", "unknown")
"""Kinds by their numbers, where only numbers can be deformation."""

DEFORMATION_UNITS = ("relative", "strain", "rad")
"""Units of amounts by their numbers."""

DeformedFrame = tuple[int | None, float, Deformation | None]
"""Index of a frame in the recording (None where that does not hold it), its time, and how the sheet
is deformed in it."""


def _column(name: str, unit: str, part: str) -> str:
    return "_".join(filter(None, (name, "" if part == "value" else part, unit)))


DEFORMATION_COLUMNS = (
    *("frame", "time_s", "kind", "unit"),
    *(_column(name, unit, part) for name, unit in _NUMBERS.items() for part in _PARTS),
    "confused",
)
"""Columns of the table of deformations: each number with the interval that nine in ten lie in."""


def deformation_content(deformation: Deformation | None) -> dict[str, Any] | None:
    """As plain values by name, with its sentence; None where the sheet is not deformed."""
    if deformation is None:
        return None
    return deformation.facts | {"text": deformation.text}


def deformation_of(content: Mapping[str, Any] | None) -> Deformation | None:
    """The deformation that a content says."""
    if content is None:
        return None
    given = {name: content.get(name) for name in _NUMBERS}
    numbers = {
        name: one and EstimatedNumber(*(_finite(one[part]) for part in _PARTS))
        for name, one in given.items()
    }
    return Deformation(content["kind"], unit=content["unit"], confused=content["confused"],
                       **numbers)  # fmt: skip


def _finite(value: float | None) -> float:
    """A number of a document, in which what is not finite is null."""
    return math.nan if value is None else float(value)


def deformation_numbers(deformation: Deformation | None) -> dict[str, float]:
    """Each number and the ends of its interval, by the names of its columns; NaN where none is."""
    numbers = {}
    for name, unit in _NUMBERS.items():
        one = deformation and getattr(deformation, name)
        for part in _PARTS:
            numbers[_column(name, unit, part)] = getattr(one, part) if one else math.nan
    return numbers


def deformation_state(deformation: Deformation | None) -> dict[str, float]:
    """All of it as numbers by name, for programs that take nothing else: ``kind`` and ``unit``
    count in :data:`DEFORMATION_KINDS` and :data:`DEFORMATION_UNITS`."""
    if deformation is None:
        return {"kind": 0.0, "unit": math.nan, **deformation_numbers(None)}
    kind = DEFORMATION_KINDS.index(deformation.kind)
    unit = DEFORMATION_UNITS.index(deformation.unit)
    return {"kind": float(kind), "unit": float(unit), **deformation_numbers(deformation)}


def deformation_rows(frames: Iterable[DeformedFrame]) -> Iterator[tuple[Any, ...]]:
    """One row a frame that is told as deformed, in the order of :data:`DEFORMATION_COLUMNS`; a
    frame that the recording does not hold is -1."""
    for frame, time, deformation in frames:
        if deformation is not None:
            numbers = deformation_numbers(deformation).values()
            number = -1 if frame is None else frame
            yield (
                number,
                time,
                deformation.kind,
                deformation.unit,
                *numbers,
                deformation.confused or "",
            )


@dataclass(frozen=True, slots=True)
class DeformationSpan:
    """A deformation of one kind from its first frame to its last, s; ``deformation`` is that of the
    frame in which it is largest."""

    begin: float
    end: float
    deformation: Deformation


def deformation_spans(
    frames: Iterable[tuple[float, Deformation | None]],
) -> tuple[DeformationSpan, ...]:
    """The deformations in (time, deformation) of frames, one after the other."""
    spans: list[DeformationSpan] = []
    goes_on = False
    for time, deformation in frames:
        if deformation is None:
            goes_on = False
        elif goes_on and spans[-1].deformation.kind == deformation.kind:
            largest = max(spans[-1].deformation, deformation, key=_size)
            spans[-1] = DeformationSpan(spans[-1].begin, time, largest)
        else:
            spans.append(DeformationSpan(time, time, deformation))
            goes_on = True
    return tuple(spans)


def _size(deformation: Deformation) -> float:
    amounts = [one.value for one in (deformation.amount, deformation.across) if one is not None]
    return max(map(abs, amounts), default=0.0)
