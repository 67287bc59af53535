"""Electrodes on a body with an upright wall: on the wall, on the bottom, on the top."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from tomoskin.core import FloatArray, GeometryError
from tomoskin.model.mesh.boundary import MIN_GAP, ElectrodeArc, among, check_width
from tomoskin.model.mesh.outline import Outline

_SAME = 1e-7
"""Places nearer than this fraction of the outline's length are one."""


@dataclass(frozen=True, slots=True)
class WallPatch:
    """Electrode on the wall: a stretch of the outline from ``bottom`` to ``top``, m.

    Its edges are resolved exactly; without an arc it goes all the way round.
    """

    bottom: float
    top: float
    arc: ElectrodeArc | None = None

    def width(self, outline: Outline) -> float:
        """The length of the patch along the wall, in m."""
        return outline.length if self.arc is None else self.arc.width(outline)

    def holds(self, outline: Outline, s: FloatArray) -> NDArray[np.bool_]:
        """(n,) True for arclengths ``s`` within the patch."""
        if self.arc is None:
            return np.ones(len(s), dtype=bool)
        return np.asarray((s - self.arc.start) % outline.length < self.arc.width(outline))


@dataclass(frozen=True, slots=True)
class FacePatch:
    """Electrode on the bottom or the top: all of it, or what lies inside ``outline``.

    ``outline`` is moved by ``centre`` (x, y) m. Its edge is not resolved: the electrode is made
    of the triangles whose centroid lies inside, so that its area is right to about one triangle's
    width around its edge. Ask for more cells where that is too coarse.
    """

    face: Literal["bottom", "top"]
    outline: Outline | None = None
    centre: tuple[float, float] = (0.0, 0.0)

    def holds(self, xy: FloatArray) -> NDArray[np.bool_]:
        """(n,) True for points ``xy`` (n, 2) within the patch."""
        if self.outline is None:
            return np.ones(len(xy), dtype=bool)
        return self.outline.contains(xy - np.asarray(self.centre))


Patch = WallPatch | FacePatch
"""An electrode of a body."""


def ring(
    outline: Outline, count: int, width: float, bottom: float, top: float
) -> tuple[WallPatch, ...]:
    """``count`` equal electrodes of arclength ``width`` m, evenly spaced around the wall.

    Numbered as the built-in skins are: the first one towards +y, then clockwise seen from above.
    """
    if count < 1:
        raise GeometryError(f"expected at least 1 electrode, got {count}")
    first = outline.toward(math.pi / 2)
    centres = [first - k * outline.length / count for k in range(count)]
    return tuple(WallPatch(bottom, top, ElectrodeArc.around(s, width)) for s in centres)


def check_patches(outline: Outline, height: float, patches: Sequence[Patch]) -> None:
    """Raise GeometryError that names the electrode that does not fit or overlaps another."""
    if not patches:
        raise GeometryError("expected at least one electrode, got none")
    wall = [(i, p) for i, p in enumerate(patches) if isinstance(p, WallPatch)]
    for number, patch in wall:
        _check_heights(height, patch, f"E{number + 1}")
        if patch.arc is not None:
            check_width(outline, patch.arc, f"E{number + 1}")
    for (low, one), (high, other) in combinations(wall, 2):
        _check_apart(outline, one, other, low, high)


def _check_heights(height: float, patch: WallPatch, where: str) -> None:
    if not 0 <= patch.bottom < patch.top <= height * (1 + 1e-9):
        raise GeometryError(
            f"expected 0 ≤ bottom < top ≤ {height * 1e3:.4g} mm, "
            f"got {patch.bottom * 1e3:.4g} mm to {patch.top * 1e3:.4g} mm",
            where=where,
        )


def _check_apart(outline: Outline, one: WallPatch, other: WallPatch, low: int, high: int) -> None:
    """Two patches must stand apart along the outline or in height."""
    heights = one.top - one.bottom, other.top - other.bottom
    aside = max(one.bottom, other.bottom) - min(one.top, other.top)
    along = _gap(outline, one, other)
    widths = one.width(outline), other.width(outline)
    slack = 1 - 1e-9
    if aside >= slack * MIN_GAP * min(heights) or along >= slack * MIN_GAP * min(widths):
        return
    raise GeometryError(
        f"overlaps or touches E{low + 1}",
        where=f"E{high + 1}",
        hint=f"leave {MIN_GAP:.0%} of the smaller one's width or height between them",
    )


def _gap(outline: Outline, one: WallPatch, other: WallPatch) -> float:
    """Arclength between two patches; below 0 where they overlap."""
    if one.arc is None or other.arc is None:
        return -min(one.width(outline), other.width(outline))
    ahead = (other.arc.start - one.arc.start) % outline.length - one.width(outline)
    behind = (one.arc.start - other.arc.start) % outline.length - other.width(outline)
    return min(ahead, behind)


def footprint(outline: Outline, patches: Sequence[Patch]) -> tuple[list[ElectrodeArc], FloatArray]:
    """Arcs that stand apart, and arclengths that must be nodes beside them, for ``triangulate``.

    Arcs of patches at different heights may coincide or overlap; together they are one arc,
    and their ends inside it are marks. ``triangulate`` wants an arc, and one that is not all
    of the rim: the longest stretch is omitted where patches cover the rim, and a short
    stretch at its start stands in where no patch has an arc.
    """
    length = outline.length
    arcs = [p.arc for p in patches if isinstance(p, WallPatch) and p.arc is not None]
    if not arcs:
        return [ElectrodeArc.around(0.0, length / 64)], np.zeros(0)
    start = np.array([a.start % length for a in arcs])
    width = np.array([a.width(outline) for a in arcs])
    ends = _distinct(np.concatenate([start, start + width]) % length, length)
    span = np.append(ends[1:], ends[0] + length) - ends
    middle = ends + span / 2
    covered = ((middle[:, None] - start) % length < width).any(axis=1)
    covered |= span < MIN_GAP * length  # leave no gap that check_arcs could refuse
    if covered.all():
        covered[np.argmax(span)] = False
    marks = ends[covered & np.roll(covered, 1)]
    return _runs(ends, span, covered), marks[~among(marks, outline.corners, length)]


def _distinct(s: FloatArray, length: float) -> FloatArray:
    """Ascending arclengths without those that rounding alone tells apart."""
    order = np.sort(s)
    gap = np.append(np.diff(order), order[0] + length - order[-1])
    return np.asarray(order[gap > _SAME * length])


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
