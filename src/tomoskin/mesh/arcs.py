"""Electrodes as stretches of the outline."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from tomoskin.core import GeometryError
from tomoskin.mesh.outline import Outline

MIN_GAP = 0.01
"""Two electrodes must stand at least this fraction of the narrower one apart."""


@dataclass(frozen=True, slots=True)
class ElectrodeArc:
    """The outline from arclength ``start`` counter-clockwise to ``end``, m; may wrap past 0.

    With ``end`` below ``start`` the arc runs through the outline's start.
    """

    start: float
    end: float

    @classmethod
    def around(cls, centre: float, width: float) -> ElectrodeArc:
        """Arc of ``width`` m around the arclength ``centre``."""
        return cls(centre - width / 2, centre + width / 2)

    def width(self, outline: Outline) -> float:
        """Length of the arc, m."""
        span = self.end - self.start
        return span if span >= 0 else span + outline.length


def check_arcs(outline: Outline, arcs: Sequence[ElectrodeArc]) -> None:
    """Raise GeometryError that names the electrode that cannot stand where it is put."""
    if not arcs:
        raise GeometryError("expected at least one electrode, got none")
    for number, arc in enumerate(arcs):
        _check_width(outline, arc, f"electrode {number}")
    order = sorted(range(len(arcs)), key=lambda i: arcs[i].start % outline.length)
    for this, following in zip(order, [*order[1:], order[0]], strict=True):
        if this != following:
            _check_gap(outline, arcs, this, following)


def _check_width(outline: Outline, arc: ElectrodeArc, where: str) -> None:
    if not (math.isfinite(arc.start) and math.isfinite(arc.end)):
        raise GeometryError("expected finite arclengths", where=where)
    width = arc.width(outline)
    if not width > 1e-6 * outline.length:
        raise GeometryError(f"expected a width above 0 mm, got {width * 1e3:g} mm", where=where)
    if not width < outline.length * (1 - 1e-6):
        raise GeometryError(
            f"is {width * 1e3:.4g} mm wide, longer than the outline "
            f"({outline.length * 1e3:.4g} mm)",
            where=where,
        )


def _check_gap(outline: Outline, arcs: Sequence[ElectrodeArc], this: int, following: int) -> None:
    width = arcs[this].width(outline)
    room = (arcs[following].start - arcs[this].start) % outline.length
    smallest = MIN_GAP * min(width, arcs[following].width(outline))
    if room - width < smallest * (1 - 1e-9):
        low, high = sorted((this, following))
        gap = room - width
        state = f"overlaps electrode {low} by {-gap * 1e3:.3g} mm"
        if gap > -1e-9 * outline.length:
            state = (
                f"stands {max(gap, 0.0) * 1e3:.3g} mm from electrode {low}; "
                f"expected at least {MIN_GAP:.0%} of the narrower one's width "
                f"({smallest * 1e3:.3g} mm)"
            )
        raise GeometryError(
            state, where=f"electrode {high}", hint="make them narrower or fewer, or move them"
        )
