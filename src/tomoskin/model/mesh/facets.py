"""Polygons, cut into triangles that cover them exactly, convex or not."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from tomoskin.core import FloatArray, GeometryError, IntArray

_FLAT = 1e-9
"""Corners that turn by less, as a part of the polygon's size squared, lie on a straight side."""


def triangulated(points: FloatArray, polygons: Iterable[Sequence[int]]) -> IntArray:
    """(n, 3) triangles of ``polygons``, given as numbers of ``points`` (m, 3), in their order.

    Corners that repeat the one before are left out, and so is what has fewer than three then.

    Raises
    ------
    GeometryError
        For a polygon whose sides cross.
    """
    tables: list[IntArray] = []
    alike: list[Sequence[int]] = []
    for polygon in polygons:
        if alike and len(polygon) != len(alike[0]):
            tables.append(_cut(points, np.array(alike, dtype=np.int64)))
            alike = []
        alike.append(polygon)
    if alike:
        tables.append(_cut(points, np.array(alike, dtype=np.int64)))
    return np.concatenate([np.zeros((0, 3), np.int64), *tables])


def _cut(points: FloatArray, polygons: IntArray) -> IntArray:
    """(n, 3) of polygons (m, k) of equally many corners."""
    if polygons.shape[1] < 3:
        return np.zeros((0, 3), np.int64)
    if polygons.shape[1] == 3:
        return polygons
    corner = points[polygons]
    ahead = np.roll(corner, -1, axis=1) - corner
    turn = np.cross(np.roll(ahead, 1, axis=1), ahead)
    normal = np.cross(corner - corner[:, :1], np.roll(corner, -1, axis=1) - corner[:, :1]).sum(1)
    size = np.maximum(np.linalg.norm(normal, axis=1), 1e-300)
    turns = np.einsum("nkd,nd->nk", turn, normal) / size[:, None]
    convex = (turns > _FLAT * size[:, None]).all(axis=1) & (_windings(ahead, normal) < 1.5)
    fan = [(0, k, k + 1) for k in range(1, polygons.shape[1] - 1)]
    parts = [
        polygon[np.array(fan)] if is_convex else _clipped(points, polygon)
        for polygon, is_convex in zip(polygons, convex.tolist(), strict=True)
    ]
    return np.concatenate(parts)


def _windings(ahead: FloatArray, normal: FloatArray) -> FloatArray:
    """(m,) how often the sides (m, k, 3) go round: a star of five turns left only, and twice."""
    back = np.roll(ahead, 1, axis=1)
    unit = normal / np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-300)
    across = np.einsum("nkd,nd->nk", np.cross(back, ahead), unit)
    angle = np.arctan2(across, (back * ahead).sum(axis=2))
    return np.asarray(np.abs(angle.sum(axis=1)) / (2 * np.pi))


def _clipped(points: FloatArray, polygon: IntArray) -> IntArray:
    """Ears that are cut off one by one, the best shaped first (Meisters, 1975)."""
    ring = [c for c, before in zip(polygon, np.roll(polygon, 1), strict=True) if c != before]
    flat = _in_plane(points[ring])
    kept, triangles = list(range(len(ring))), []
    crossing = _crosses(flat)
    while len(kept) > 3:
        at = None if crossing else _ear(flat[kept])
        if at is None:
            listed = ", ".join(map(str, polygon[:8].tolist()))
            raise GeometryError(
                f"expected polygons whose sides do not cross, got one of the points {listed}",
                hint="cut it into triangles before saving",
            )
        triangles.append([kept[at - 1], kept[at], kept[(at + 1) % len(kept)]])
        del kept[at]
    if len(kept) == 3:
        triangles.append(kept)
    return np.array(ring, dtype=np.int64)[np.array(triangles, dtype=np.int64).reshape(-1, 3)]


def _crosses(flat: FloatArray) -> bool:
    """Whether two sides of (k, 2) pass through each other."""
    start, end = flat, np.roll(flat, -1, axis=0)
    along = (end - start)[:, None]
    sides = [_cross(along, ends[None] - start[:, None]) for ends in (start, end)]
    apart = sides[0] * sides[1] < -((_FLAT * float(np.ptp(flat, axis=0).max()) ** 2) ** 2)
    return bool((apart & apart.T).any())


def _in_plane(corner: FloatArray) -> FloatArray:
    """(k, 2): seen along the polygon's normal, counter-clockwise."""
    middle = corner - corner.mean(axis=0)
    normal = np.cross(middle, np.roll(middle, -1, axis=0)).sum(axis=0)
    first = np.eye(3)[np.argmin(np.abs(normal))]
    x = np.cross(first, normal)
    x /= max(float(np.linalg.norm(x)), 1e-300)
    y = np.cross(normal, x)
    y /= max(float(np.linalg.norm(y)), 1e-300)
    return np.column_stack([middle @ x, middle @ y])


def _ear(flat: FloatArray) -> int | None:
    """The best shaped corner of (k, 2) that can be cut off: it turns left, and holds no other."""
    before, after = np.roll(flat, 1, axis=0), np.roll(flat, -1, axis=0)
    u, v = flat - before, after - flat
    area = _cross(u, v)
    sides = (u**2).sum(1) + (v**2).sum(1) + ((after - before) ** 2).sum(1)
    shape = area / np.maximum(sides, 1e-300)
    size = float(np.ptp(flat, axis=0).max()) ** 2
    for at in np.argsort(-shape).tolist():
        if area[at] <= _FLAT * size:
            return None
        a, b, c = before[at], flat[at], after[at]
        inside = np.min([_cross(q - p, flat - p) for p, q in ((a, b), (b, c), (c, a))], axis=0)
        ends = ((flat[:, None] == np.array([a, b, c])).all(axis=2)).any(axis=1)
        if not ((inside >= -_FLAT * size) & ~ends).any():
            return int(at)
    return None


def _cross(u: FloatArray, v: FloatArray) -> FloatArray:
    return np.asarray(u[..., 0] * v[..., 1] - u[..., 1] * v[..., 0])
