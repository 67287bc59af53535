"""Whether vertices describe a simple polygon, and if not, which of them is at fault."""

from __future__ import annotations

import numpy as np

from tomoskin.core import FloatArray, GeometryError

_TOUCH = 1e-9
"""Two points nearer than this fraction of the polygon's size count as one."""


def check_simple(vertices: FloatArray) -> None:
    """Raise GeometryError that names the first vertex or side that is wrong."""
    _check_table(vertices)
    size = float(np.ptp(vertices, axis=0).max())
    _check_repeats(vertices, size)
    offset = vertices - vertices[0]
    far = offset[np.argmax(np.linalg.norm(offset, axis=1))]
    if np.abs(offset[:, 0] * far[1] - offset[:, 1] * far[0]).max() <= _TOUCH * size**2:
        raise GeometryError("the polygon has no area", hint="its vertices lie on a line")
    _check_crossings(vertices, size)


def _check_table(vertices: FloatArray) -> None:
    if vertices.ndim != 2 or vertices.shape[1:] != (2,) or len(vertices) < 3:
        raise GeometryError(
            f"expected at least 3 vertices of 2 coordinates, got shape {vertices.shape}"
        )
    finite = np.isfinite(vertices).all(axis=1)
    if not finite.all():
        raise GeometryError("expected finite coordinates", where=f"vertex {np.argmin(finite)}")


def _check_repeats(vertices: FloatArray, size: float) -> None:
    for i in range(len(vertices)):
        gap = np.abs(vertices[i + 1 :] - vertices[i]).max(axis=1)
        if (gap <= _TOUCH * size).any():
            j = i + 1 + int(np.argmax(gap <= _TOUCH * size))
            raise GeometryError(
                f"repeats vertex {i}",
                where=f"vertex {j}",
                hint="leave it out; an outline closes by itself",
            )


def _check_crossings(vertices: FloatArray, size: float) -> None:
    """Each side against all later ones that are not its neighbours, and spikes."""
    n = len(vertices)
    ends = np.roll(vertices, -1, axis=0)
    for i in range(n):
        others = np.arange(i + 1, n)
        others = others[((others - i) % n != 1) & ((i - others) % n != 1)]
        apart = _separation(vertices[i], ends[i], vertices[others], ends[others])
        if (apart <= _TOUCH * size).any():
            j = int(others[np.argmax(apart <= _TOUCH * size)])
            raise GeometryError(
                f"the side from vertex {i} to {(i + 1) % n} meets "
                f"the side from vertex {j} to {(j + 1) % n}",
                where=f"vertex {i}",
                hint="an outline may not cross or touch itself",
            )
        back, ahead = vertices[i - 1] - vertices[i], ends[i] - vertices[i]
        cross = abs(back[0] * ahead[1] - back[1] * ahead[0])
        if back @ ahead > 0 and cross <= _TOUCH * size * np.linalg.norm(ahead):
            raise GeometryError("the outline turns back on itself", where=f"vertex {i}")


def _separation(a: FloatArray, b: FloatArray, c: FloatArray, d: FloatArray) -> FloatArray:
    """(n,) distance between segment ab and each segment cd; 0 where they cross."""
    crossing = (_side(a, b, c) * _side(a, b, d) < 0) & (_side(c, d, a) * _side(c, d, b) < 0)
    gaps = [_gap(c, a, b), _gap(d, a, b), _gap(a, c, d), _gap(b, c, d)]
    return np.where(crossing, 0.0, np.min(gaps, axis=0))


def _side(a: FloatArray, b: FloatArray, p: FloatArray) -> FloatArray:
    u, v = b - a, p - a
    return np.asarray(u[..., 0] * v[..., 1] - u[..., 1] * v[..., 0])


def _gap(p: FloatArray, a: FloatArray, b: FloatArray) -> FloatArray:
    """Distance from points ``p`` to segments ``ab``."""
    step = b - a
    along = np.clip(((p - a) * step).sum(axis=-1) / (step**2).sum(axis=-1), 0.0, 1.0)
    return np.asarray(np.linalg.norm(p - a - along[..., None] * step, axis=-1))
