"""The rim of a mesh: stretches of it under electrodes, and its nodes; and how large a cell should
be where: small at sources, growing with distance, capped."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from tomoskin.core import FloatArray, GeometryError, IntArray
from tomoskin.model.mesh.outline import Outline
from tomoskin.model.mesh.polygon import inside, off_segment


@dataclass(frozen=True, eq=False)
class SizeField:
    """Edge length wanted at a point: min(coarse, minᵢ(sizesᵢ + growth·|x − pointsᵢ|)).

    Attributes
    ----------
    coarse
        Edge length far from every source, m.
    points
        (n, 2) sources, m.
    sizes
        (n,) edge length wanted at each, m.
    growth
        Edge length gained per unit of distance from a source.
    """

    coarse: float
    points: FloatArray
    sizes: FloatArray
    growth: float

    def __call__(self, xy: FloatArray) -> FloatArray:
        """(n,) edge length wanted at ``xy`` (n, 2), m; the nearest few sources decide."""
        reach = (self.coarse - self.sizes.min()) / self.growth
        if reach <= 0:
            return np.full(len(xy), self.coarse)
        k = min(8, len(self.sizes))
        gap, index = self._tree.query(xy, k=k, distance_upper_bound=reach)
        padded = np.append(self.sizes, np.inf)  # the tree says n for "no neighbour"
        size = (padded[index] + self.growth * gap).reshape(len(xy), k).min(axis=1)
        return np.asarray(np.minimum(size, self.coarse))

    @cached_property
    def _tree(self) -> cKDTree:
        return cKDTree(self.points)


def running(density: FloatArray, at: FloatArray) -> FloatArray:
    """(n,) integral of a density (n,) from the first of the places ``at`` (n,) to each."""
    steps = np.diff(at) * (density[1:] + density[:-1]) / 2
    return np.concatenate([[0.0], np.cumsum(steps)])


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
        """The length of the arc on this outline, in m."""
        span = self.end - self.start
        return span if span >= 0 else span + outline.length


def check_arcs(outline: Outline, arcs: Sequence[ElectrodeArc]) -> None:
    """Raise GeometryError that names the electrode that cannot stand where it is put."""
    if not arcs:
        raise GeometryError("expected at least one electrode, got none")
    for number, arc in enumerate(arcs):
        check_width(outline, arc, f"E{number + 1}")
    order = sorted(range(len(arcs)), key=lambda i: arcs[i].start % outline.length)
    for this, following in zip(order, [*order[1:], order[0]], strict=True):
        if this != following:
            _check_gap(outline, arcs, this, following)


def check_width(outline: Outline, arc: ElectrodeArc, where: str) -> None:
    """Raise GeometryError where an arc is none, or longer than the outline."""
    if not (math.isfinite(arc.start) and math.isfinite(arc.end)):
        raise GeometryError(
            f"expected finite arclengths, got {arc.start} to {arc.end} m", where=where
        )
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
        state = f"overlaps E{low + 1} by {-gap * 1e3:.3g} mm"
        if gap > -1e-9 * outline.length:
            state = (
                f"is {max(gap, 0.0) * 1e3:.3g} mm from E{low + 1}; expected at least "
                f"{MIN_GAP:.0%} of the narrower one's width ({smallest * 1e3:.3g} mm)"
            )
        raise GeometryError(
            state, where=f"E{high + 1}", hint="make them narrower or fewer, or move them"
        )


AT_ELECTRODE = 0.4
"""Edge length at an electrode, as a fraction of that far from all electrodes."""

MIN_FACETS = 2
"""An electrode is cut into at least this many facets."""

_MOST_NODES = 300_000
"""No mesh of 100,000 cells has so many rim nodes; each turn may double them."""

_SAME = 1e-7
"""Nodes nearer than this fraction of the outline's length are one."""

_MARGIN = 1.02
"""Circles are taken so much larger than they are."""


@dataclass(frozen=True, eq=False)
class Boundary:
    """A closed chain of rim nodes, counter-clockwise; edge i runs from node i to i + 1.

    Attributes
    ----------
    s
        (n,) arclengths, ascending, the first one below ``length``; m.
    points
        (n, 2) m.
    owner
        (n,) electrode that edge i belongs to, −1 for none.
    """

    s: FloatArray
    points: FloatArray
    owner: IntArray

    @property
    def midpoints(self) -> FloatArray:
        """(n, 2) middle of each edge, m."""
        return np.asarray((self.points + np.roll(self.points, -1, axis=0)) / 2)

    @property
    def lengths(self) -> FloatArray:
        """(n,) length of each edge, m."""
        return np.asarray(np.linalg.norm(np.roll(self.points, -1, axis=0) - self.points, axis=1))


def breakpoints(
    outline: Outline, arcs: Sequence[ElectrodeArc], corners: FloatArray
) -> tuple[FloatArray, IntArray]:
    """Arclengths that must be nodes, ascending, and the electrode that follows each (or −1)."""
    length = outline.length
    ends = [(a.start % length, (a.start + a.width(outline)) % length) for a in arcs]
    exact = np.array(ends).ravel()
    corners = corners % length
    # an electrode that ends at a corner ends exactly there
    corners = corners[~among(corners, exact, length)]
    nodes = np.unique(np.concatenate([exact, corners]))
    middle = (nodes + (np.append(nodes[1:], nodes[0] + length) - nodes) / 2) % length
    owner = np.full(len(nodes), -1)
    for number, (arc, (start, _)) in enumerate(zip(arcs, ends, strict=True)):
        owner[(middle - start) % length < arc.width(outline)] = number
    return nodes, owner


def discretise(
    outline: Outline,
    arcs: Sequence[ElectrodeArc],
    corners: FloatArray,
    coarse: float,
    growth: float,
) -> Boundary:
    """Rim nodes for cells of edge length ``coarse`` m far from the electrodes.

    ``corners``, arclengths in m, are nodes too.

    Every edge's diametral circle is free of other nodes, so that each edge is in every
    Delaunay triangulation whose inner points keep out of those circles too.
    """
    nodes, owner = breakpoints(outline, arcs, corners)
    spans = np.diff(nodes, append=nodes[0] + outline.length)
    field = _rim_sizes(outline, nodes, owner, coarse, growth)
    pieces, owners = [], []
    for start, span, electrode in zip(nodes, spans, owner, strict=True):
        least = MIN_FACETS if electrode >= 0 else 1
        piece = _graded(outline, start, span, field, least)
        pieces.append(piece)
        owners.append(np.full(len(piece), electrode))
    s, who = np.concatenate(pieces), np.concatenate(owners)
    return _split_encroached(outline, corners, s, who)


def _rim_sizes(
    outline: Outline, nodes: FloatArray, owner: IntArray, coarse: float, growth: float
) -> SizeField:
    """Sources along electrodes and short stretches; nothing asks for more than its own span."""
    spans = np.diff(nodes, append=nodes[0] + outline.length)
    points, sizes = [], []
    for start, span, electrode in zip(nodes, spans, owner, strict=True):
        size = min(AT_ELECTRODE * coarse, span / MIN_FACETS) if electrode >= 0 else span
        if size < coarse:
            count = 1 + math.ceil(2 * span / size)
            points.append(outline.point(np.linspace(start, start + span, count)))
            sizes.append(np.full(count, size))
    return SizeField(coarse, np.concatenate(points), np.concatenate(sizes), growth)


def _graded(
    outline: Outline, start: float, span: float, field: SizeField, least: int
) -> FloatArray:
    """Arclengths from ``start`` (included) to its end (excluded), spaced as the field asks."""
    samples = 1 + max(16, math.ceil(3 * span / field.sizes.min()))
    s = np.linspace(0.0, span, min(samples, 20_001))
    count = running(1.0 / field(outline.point(start + s)), s)
    parts = max(least, round(float(count[-1])))
    target = np.arange(parts) * (count[-1] / parts)
    return np.asarray(start + np.interp(target, count, s))


def _split_encroached(
    outline: Outline, corners: FloatArray, s: FloatArray, owner: IntArray
) -> Boundary:
    """Halve edges until no node lies in another edge's diametral circle.

    Next to a corner the cut is made at a power-of-two distance from it, so that the two
    sides of a sharp corner are cut the same way and the splitting ends.
    """
    for _ in range(60):
        rim = Boundary(s, outline.point(s), owner)
        tree = cKDTree(rim.points)
        gap, _near = tree.query(rim.midpoints)
        bad = gap < rim.lengths / 2 * (1 - 1e-7)
        if not bad.any():
            return rim
        ahead = np.append(s[1:], s[0] + outline.length)
        cut = _cut(s[bad], ahead[bad], corners, outline.length)
        s = np.concatenate([s, cut])
        owner = np.concatenate([owner, owner[bad]])
        order = np.argsort(s, kind="stable")
        s, owner = s[order], owner[order]
        if len(s) > _MOST_NODES:
            break
    worst = rim.points[int(np.argmax(rim.lengths * bad))] * 1e3
    raise GeometryError(
        "two parts of the outline are too close to each other for a mesh",
        where=f"near ({worst[0]:.4g}, {worst[1]:.4g}) mm",
    )


def _cut(start: FloatArray, end: FloatArray, corners: FloatArray, length: float) -> FloatArray:
    """Where to cut each edge: its middle, or a power of two from the corner it begins at."""
    span = end - start
    shell = 2.0 ** np.round(np.log2(span / 2))
    at_start, at_end = among(start, corners, length), among(end, corners, length)
    cut = start + span / 2
    cut = np.where(at_start & ~at_end, start + shell, cut)
    return np.where(at_end & ~at_start, end - shell, cut)


def among(s: FloatArray, others: FloatArray, length: float) -> NDArray[np.bool_]:
    """(n,) whether arclengths of an outline of that ``length`` are one of the ``others``."""
    gap = np.abs((s[:, None] - others[None] + length / 2) % length - length / 2)
    return np.asarray(gap.min(axis=1, initial=np.inf) <= _SAME * length)


def rim_distance(rim: Boundary, xy: FloatArray) -> FloatArray:
    """(n,) distance to the rim edges that touch the three nearest nodes, m."""
    if not len(xy):
        return np.zeros(0)
    count = len(rim.points)
    _, node = cKDTree(rim.points).query(xy, k=3)
    edge = np.concatenate([node, (node - 1) % count], axis=1)
    ends = np.roll(rim.points, -1, axis=0)[edge]
    return np.asarray(off_segment(xy[:, None], rim.points[edge], ends).min(axis=1))


def keeps_clear(rim: Boundary, xy: FloatArray) -> NDArray[np.bool_]:
    """(n,) True where a point is inside the rim and outside every edge's diametral circle."""
    if not len(xy):
        return np.zeros(0, dtype=bool)
    result = inside(rim.points, xy)
    held = cKDTree(xy).query_ball_point(rim.midpoints, rim.lengths / 2 * _MARGIN)
    result[np.concatenate(held).astype(np.int64)] = False
    return result
