"""Where a place lies in a triangle, or which of its points is nearest; whole tables at once."""

from __future__ import annotations

import numpy as np

from tomoskin.core import FloatArray


def barycentric(corner: FloatArray, place: FloatArray) -> FloatArray:
    """(…, 3) shares of the corners (…, 3, 2) at ``place`` (…, 2)."""
    u, v = corner[..., 1, :] - corner[..., 0, :], corner[..., 2, :] - corner[..., 0, :]
    w = place - corner[..., 0, :]
    area = u[..., 0] * v[..., 1] - u[..., 1] * v[..., 0]
    p = (w[..., 0] * v[..., 1] - w[..., 1] * v[..., 0]) / area
    q = (u[..., 0] * w[..., 1] - u[..., 1] * w[..., 0]) / area
    return np.stack([1.0 - p - q, p, q], axis=-1)


def closest(corner: FloatArray, place: FloatArray) -> FloatArray:
    """(…, 3) shares of the point of each triangle (…, 3, 3) that is nearest to ``place`` (…, 3).

    The foot on the plane where it lies inside, else the best foot on the three sides.
    """
    place = np.broadcast_to(place, (*corner.shape[:-2], 3))
    u, v = corner[..., 1, :] - corner[..., 0, :], corner[..., 2, :] - corner[..., 0, :]
    w = place - corner[..., 0, :]
    gram = np.stack(
        [
            np.stack([(u * u).sum(-1), (u * v).sum(-1)], -1),
            np.stack([(u * v).sum(-1), (v * v).sum(-1)], -1),
        ],
        -1,
    )
    right = np.stack([(w * u).sum(-1), (w * v).sum(-1)], -1)
    pq = np.linalg.solve(gram, right[..., None])[..., 0]
    foot = np.concatenate([1.0 - pq.sum(-1, keepdims=True), pq], axis=-1)
    shares = [foot]
    for a, b in ((0, 1), (1, 2), (2, 0)):
        side = corner[..., b, :] - corner[..., a, :]
        t = ((place - corner[..., a, :]) * side).sum(-1) / (side * side).sum(-1)
        t = np.clip(t, 0.0, 1.0)
        share = np.zeros(corner.shape[:-1])
        share[..., a], share[..., b] = 1.0 - t, t
        shares.append(share)
    table = np.stack(shares)
    gap = np.linalg.norm(np.einsum("...k,...kd->...d", table, corner) - place, axis=-1)
    gap[0][foot.min(axis=-1) < 0] = np.inf
    best = gap.argmin(axis=0)
    return np.asarray(np.take_along_axis(table, best[None, ..., None], axis=0)[0])
