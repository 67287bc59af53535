"""What the flat mesh under a body must resolve: every end of every patch on the wall."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tomoskin.core import FloatArray
from tomoskin.mesh.arcs import MIN_GAP, ElectrodeArc
from tomoskin.mesh.outline import Outline
from tomoskin.mesh.patch import Patch, WallPatch

_SAME = 1e-7
"""Places nearer than this fraction of the outline's length are one."""


def footprint(outline: Outline, patches: Sequence[Patch]) -> tuple[Outline, list[ElectrodeArc]]:
    """An outline with marks, and arcs that stand apart, for ``triangulate``.

    Arcs of patches at different heights may coincide or overlap; together they are one arc,
    and their ends inside it are marks. ``triangulate`` wants an arc, and one that is not the
    whole rim: the longest stretch is left out where patches cover the rim, and a short
    stretch at its start stands in where no patch has an arc.
    """
    length = outline.length
    arcs = [p.arc for p in patches if isinstance(p, WallPatch) and p.arc is not None]
    if not arcs:
        return outline, [ElectrodeArc.around(0.0, length / 64)]
    start = np.array([a.start % length for a in arcs])
    width = np.array([a.width(outline) for a in arcs])
    ends = _distinct(np.concatenate([start, start + width]) % length, length)
    span = np.append(ends[1:], ends[0] + length) - ends
    middle = ends + span / 2
    covered = ((middle[:, None] - start) % length < width).any(axis=1)
    covered |= span < MIN_GAP * length  # no gap is left that check_arcs could refuse
    if covered.all():
        covered[np.argmax(span)] = False
    marks = _clear_of(outline.corners, ends[covered & np.roll(covered, 1)], length)
    return (_Marked(outline, marks) if len(marks) else outline), _runs(ends, span, covered)


def _distinct(s: FloatArray, length: float) -> FloatArray:
    """Ascending arclengths without those that rounding alone tells apart."""
    order = np.sort(s)
    gap = np.append(np.diff(order), order[0] + length - order[-1])
    return np.asarray(order[gap > _SAME * length])


def _clear_of(corners: FloatArray, marks: FloatArray, length: float) -> FloatArray:
    """Marks that are not at a corner."""
    if not len(corners):
        return marks
    gap = np.abs((marks[:, None] - corners + length / 2) % length - length / 2)
    return np.asarray(marks[gap.min(axis=1) > _SAME * length])


def _runs(ends: FloatArray, span: FloatArray, covered: NDArray[np.bool_]) -> list[ElectrodeArc]:
    """Arcs over neighbouring stretches that are covered."""
    first = int(np.argmin(covered)) + 1  # begin behind a stretch that is not
    runs: list[ElectrodeArc] = []
    joined = False
    for i in np.roll(np.arange(len(ends)), -first):
        if covered[i] and joined:
            runs[-1] = ElectrodeArc(runs[-1].start, runs[-1].end + float(span[i]))
        elif covered[i]:
            runs.append(ElectrodeArc(float(ends[i]), float(ends[i] + span[i])))
        joined = bool(covered[i])
    return runs


@dataclass(frozen=True, eq=False)
class _Marked(Outline):
    """``outline`` with more places that must be nodes: ``marks``, arclengths, m."""

    outline: Outline
    marks: FloatArray

    @property
    def length(self) -> float:
        """Length of the curve, m."""
        return self.outline.length

    @property
    def area(self) -> float:
        """Area inside, m²."""
        return self.outline.area

    @property
    def centre(self) -> FloatArray:
        """(2,) centroid of the area, m."""
        return self.outline.centre

    @property
    def corners(self) -> FloatArray:
        """Corners and marks, ascending, m."""
        return np.unique(np.concatenate([self.outline.corners, self.marks % self.length]))

    def point(self, s: ArrayLike) -> FloatArray:
        """(n, 2) points at arclengths ``s``, m."""
        return self.outline.point(s)

    def contains(self, xy: ArrayLike) -> NDArray[np.bool_]:
        """(n,) True where a point lies inside."""
        return self.outline.contains(xy)

    def nearest(self, xy: ArrayLike) -> FloatArray:
        """(n,) arclengths of the rim points that are nearest."""
        return self.outline.nearest(xy)

    def toward(self, angle: float) -> float:
        """Arclength in the direction ``angle``, rad."""
        return self.outline.toward(angle)
