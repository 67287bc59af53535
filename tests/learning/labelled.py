"""Labelled presses on maps that are known."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

RADIUS = 0.1
ROWS = 40
Floats = NDArray[np.float64]


def places(n: int, seed: int) -> Floats:
    rng = np.random.default_rng(seed)
    radius, angle = RADIUS * np.sqrt(rng.random(n)), 2 * np.pi * rng.random(n)
    return np.column_stack([radius * np.cos(angle), radius * np.sin(angle)])


def presses(n: int, seed: int, noise: float = 0.05) -> tuple[Floats, Floats]:
    """Smooth bumps, one a row, at places of their own; the same for every seed."""
    xy = places(n, seed)
    centres = places(ROWS, 99)
    near = np.exp(-0.5 * ((xy[:, None] - centres) ** 2).sum(axis=2) / (0.5 * RADIUS) ** 2)
    rng = np.random.default_rng(seed + 1)
    return near * np.where(np.arange(ROWS) % 2, 1, -1) + noise * rng.normal(size=near.shape), xy


def held(error: Floats, covariance: Floats) -> float:
    """Part of the errors in their 90 % ellipse."""
    squared = (error * np.linalg.solve(covariance, error[:, :, None])[:, :, 0]).sum(axis=1)
    return float((squared < 4.605).mean())
