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
from tomoskin.mesh.arcs import MIN_GAP, ElectrodeArc, check_arcs
from tomoskin.mesh.outline import Outline


@dataclass(frozen=True, slots=True)
class WallPatch:
    """Electrode on the wall: a stretch of the outline from ``bottom`` to ``top``, m.

    Its edges are resolved exactly; without an arc it goes all the way round.
    """

    bottom: float
    top: float
    arc: ElectrodeArc | None = None

    def width(self, outline: Outline) -> float:
        """Arclength, m."""
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
        _check_heights(height, patch, f"electrode {number}")
        if patch.arc is not None:
            _check_arc(outline, patch.arc, f"electrode {number}")
    for (low, one), (high, other) in combinations(wall, 2):
        _check_apart(outline, one, other, low, high)


def _check_heights(height: float, patch: WallPatch, where: str) -> None:
    if not 0 <= patch.bottom < patch.top <= height * (1 + 1e-9):
        raise GeometryError(
            f"expected 0 ≤ bottom < top ≤ {height * 1e3:.4g} mm, "
            f"got {patch.bottom * 1e3:.4g} mm to {patch.top * 1e3:.4g} mm",
            where=where,
        )


def _check_arc(outline: Outline, arc: ElectrodeArc, where: str) -> None:
    try:
        check_arcs(outline, [arc])
    except GeometryError as error:
        raise GeometryError(error.message, where=where, hint=error.hint) from error


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
        f"overlaps or touches electrode {low}",
        where=f"electrode {high}",
        hint=f"leave {MIN_GAP:.0%} of the smaller one's width or height between them",
    )


def _gap(outline: Outline, one: WallPatch, other: WallPatch) -> float:
    """Arclength between two patches; below 0 where they overlap."""
    if one.arc is None or other.arc is None:
        return -min(one.width(outline), other.width(outline))
    ahead = (other.arc.start - one.arc.start) % outline.length - one.width(outline)
    behind = (one.arc.start - other.arc.start) % outline.length - other.width(outline)
    return min(ahead, behind)
