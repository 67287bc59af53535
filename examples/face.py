"""A face as a shell of two tissues with eight electrodes, and how six expressions move it.

Lengths in mm here, seen from the front: x to the face's left, y up, z out of it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from tomoskin.core import ComplexArray, FloatArray
from tomoskin.model.mesh import Disc, FacePatch, Mesh, extrude

HALF_AXES = np.array([75.0, 105.0, 85.0])
"""Of the half ellipsoid that the face is a part of: width, height, depth."""

OPENING = math.radians(80.0)
"""Of the shell, from its middle to its rim."""

NOSE = ((0.0, -5.0), 13.0, (0.0, 0.0, 18.0))

THICKNESS, MUSCLE = 10.0, 6.0
"""Of the shell, and of the muscle under skin and fat."""

TISSUE = {"skin and fat": 0.08 + 0.006j, "muscle": 0.35 + 0.028j}
"""S/m at 50 kHz; muscle as tabulated by Gabriel et al. (1996), the mixture above it assumed."""

CONTACT = 0.01 - 0.005j
"""Ω·m² under an electrode; assumed."""

ELECTRODES = ((-28, 62), (28, 62), (54, 8), (38, -42), (15, -78), (-15, -78), (-38, -42), (-54, 8))
"""Forehead, cheek, corner of the mouth, chin, and up the other side; 12 mm across."""

_MM = 1e-3
_FLAT = 100.0
_RADIUS = 6.0

Bump = tuple[tuple[float, float], float, tuple[float, float, float]]
"""Where on the face, over what radius (of a Gaussian), how far it moves."""


def _both(at: tuple[float, float], radius: float, by: tuple[float, float, float]) -> list[Bump]:
    """A bump on the left side and its mirror image."""
    return [(at, radius, by), ((-at[0], at[1]), radius, (-by[0], by[1], by[2]))]


_CORNER, _CHEEK, _CHIN, _BROW = (38.0, -42.0), (52.0, 5.0), (0.0, -80.0), (28.0, 60.0)

EXPRESSIONS: dict[str, list[Bump]] = {
    "A": [
        (_CHIN, 35.0, (0, -14, -4)),
        *_both(_CORNER, 20.0, (-2, -5, 0)),
        *_both(_BROW, 25, (0, 2, 0)),
    ],
    "E": [(_CHIN, 35.0, (0, -5, -1)), *_both(_CORNER, 20.0, (6, 0, -2))],
    "I": [
        (_CHIN, 35.0, (0, -2, 0)),
        *_both(_CORNER, 20.0, (8, 3, -3)),
        *_both(_CHEEK, 25.0, (1, 2, 1)),
    ],
    "O": [
        (_CHIN, 35.0, (0, -8, 0)),
        *_both(_CORNER, 20.0, (-7, -1, 4)),
        *_both(_CHEEK, 25.0, (-1, -2, 0)),
    ],
    "U": [(_CHIN, 35.0, (0, 1, 3)), *_both(_CORNER, 20.0, (-9, 0, 6))],
    "smile": [
        *_both(_CORNER, 20.0, (7, 9, -1)),
        *_both(_CHEEK, 28.0, (2, 7, 4)),
        (_CHIN, 35.0, (0, 2, 1)),
    ],
}
"""Assumed, of the size of what landmarks on faces do: 5 to 15 mm at the corners and the chin."""


@dataclass(frozen=True, eq=False)
class Face:
    """Tetrahedra in m with eight electrodes; which cells are muscle, which points on the skin."""

    mesh: Mesh
    muscle: NDArray[np.bool_]
    skin: NDArray[np.bool_]

    @property
    def tissue(self) -> ComplexArray:
        """(n_cells,) S/m."""
        return np.where(self.muscle, TISSUE["muscle"], TISSUE["skin and fat"])

    def moved(self, bumps: list[Bump], strength: float = 1.0) -> Face:
        """The same face, moved."""
        points = self.mesh.points + strength * movement(self.mesh.points, bumps)
        return replace(self, mesh=replace(self.mesh, points=points))


def face(cells: int, seed: int = 0, shift: FloatArray | None = None) -> Face:
    """A relaxed face over about ``cells`` flat triangles; electrodes ``shift`` (8, 2) mm off."""
    at = np.array(ELECTRODES) + (0.0 if shift is None else shift)
    disc = Disc(_RADIUS * _MM)
    patches = [FacePatch("top", disc, tuple(_MM * xy)) for xy in _laid_flat(at)]
    flat = extrude(
        Disc(_FLAT * _MM), THICKNESS * _MM, patches,
        cells=cells, layers=3, planes=(MUSCLE * _MM,), seed=seed,
    )  # fmt: skip
    muscle = flat.centroids[:, 2] < MUSCLE * _MM
    mesh = replace(flat, points=_MM * _on_head(flat.points / _MM))
    mesh = replace(mesh, points=mesh.points + movement(mesh.points, [NOSE]))
    return Face(mesh, muscle, flat.points[:, 2] > (THICKNESS - 1e-6) * _MM)


def movement(points: FloatArray, bumps: list[Bump]) -> FloatArray:
    """(n, 3) m by which ``bumps`` move ``points`` (n, 3) m."""
    total = np.zeros_like(points)
    for (x, y), radius, by in bumps:
        away = points / _MM - on_skin(np.array([[x, y]]))
        share = np.exp(-(away**2).sum(axis=1) / (2 * radius**2))
        total += _MM * share[:, None] * np.array(by)
    return total


def on_skin(xy: FloatArray) -> FloatArray:
    """(n, 3) mm of places (n, 2) seen from the front, without the nose."""
    part = xy / HALF_AXES[:2]
    return np.column_stack([xy, HALF_AXES[2] * np.sqrt(1 - (part**2).sum(axis=1))])


def _laid_flat(xy: FloatArray) -> FloatArray:
    part = xy / HALF_AXES[:2]
    size = np.linalg.norm(part, axis=1, keepdims=True)
    return np.asarray(part / size * np.arcsin(size) / OPENING * _FLAT)


def _on_head(points: FloatArray) -> FloatArray:
    """(n, 3) mm of the flat body's points: the distance from the middle becomes an angle."""
    size = np.maximum(np.linalg.norm(points[:, :2], axis=1), 1e-9)
    angle = size / _FLAT * OPENING
    axes = HALF_AXES - (THICKNESS - points[:, 2:])
    towards = points[:, :2] / size[:, None] * np.sin(angle)[:, None]
    return np.asarray(axes * np.column_stack([towards, np.cos(angle)]))
