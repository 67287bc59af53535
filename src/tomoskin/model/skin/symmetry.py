"""Places that a pattern cannot tell apart: a symmetry of the sheet that leaves every row as it is.

A symmetry g of sheet and electrodes takes a press at p to one at g(p), whose voltages are those of
p in rows with other electrodes. Where each of these is the same row again, by reciprocity or with
both pairs reversed, p and g(p) give the same voltages, whatever presses.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from tomoskin.core import FloatArray, IntArray, PatternError
from tomoskin.model.mesh import Mesh, Outline
from tomoskin.model.pattern import Pattern, named

NEAR = 0.1
"""A sheet counts as nearly symmetric up to this part of the distance between electrodes; and places
as hard to tell apart up to this part of the change that a press makes: a model is as far off."""

_BUMP = 0.08
"""Radius of the presses that are compared, part of the sheet's extent."""

_COMPARED = 0.7
"""Places are compared within this part of the way to the rim: cells are too coarse beyond."""

_SAME = 1e-9
"""Entries of two rows that differ by less are the same."""

_ASIDE = 0.1
"""What comes to lie nearer than this to where it was, part of the sheet's extent, is one place."""

_RIM_POINTS = 200

_TRIED = ("opposite", "adjacent", "skip:1", "skip:2", "skip:3", "all_pairs")


@dataclass(frozen=True, eq=False)
class SheetSymmetry:
    """A rotation or reflection that maps a sheet with its electrodes onto itself.

    Attributes
    ----------
    matrix, centre
        (2, 2) orthogonal, and the point that stays, (2,) m.
    electrodes
        (n,) the electrode that each one comes to lie on.
    """

    matrix: FloatArray
    centre: FloatArray
    electrodes: IntArray

    def moved(self, xy: FloatArray) -> FloatArray:
        """(n, 2) m: where places ``xy`` (n, 2) come to lie."""
        return np.asarray(xy @ self.matrix.T + self.shift)

    @property
    def shift(self) -> FloatArray:
        """(2,) m: where the origin comes to lie."""
        return np.asarray(self.centre - self.matrix @ self.centre)

    @property
    def text(self) -> str:
        """What it does, in words."""
        turn = math.degrees(math.atan2(self.matrix[1, 0], self.matrix[0, 0]))
        if np.linalg.det(self.matrix) > 0:
            return f"turned by {round(turn) % 360}° about the centre"
        return f"mirrored at the line through the centre at {round(turn / 2) % 180}° from +x"

    def keeps(self, pattern: Pattern) -> bool:
        """Whether every row of ``pattern`` is the same row again, reciprocity included."""
        moved = np.argsort(self.electrodes)
        return all(np.abs(one[np.ix_(moved, moved)] - one).max() < _SAME for one in _forms(pattern))


def unseen_symmetries(
    pattern: Pattern, outline: Outline, electrodes: FloatArray
) -> tuple[SheetSymmetry, ...]:
    """Those of an outline with the centres of its electrodes (n, 2) m, up to :data:`NEAR`, that
    leave every row of ``pattern`` as it is."""
    return tuple(
        one
        for one in _exchanges(outline.centre, electrodes)
        if one.keeps(pattern) and _fits(one, outline, electrodes)
    )


def _exchanges(centre: FloatArray, electrodes: FloatArray) -> Iterator[SheetSymmetry]:
    """Turns about ``centre`` and mirrors that bring each electrode (n, 2) m next to another one;
    that which moves none is left out."""
    arms = electrodes - centre
    angles = np.arctan2(arms[:, 1], arms[:, 0])
    for mirrored in (False, True):
        for angle in angles:
            matrix = _isometry(angle + angles[0] if mirrored else angle - angles[0], mirrored)
            onto = np.linalg.norm((arms @ matrix.T)[:, None] - arms, axis=2).argmin(axis=1)
            if len(np.unique(onto)) == len(onto) and (onto != np.arange(len(onto))).any():
                yield SheetSymmetry(_fitted(arms, arms[onto], mirrored), centre, onto)


def _fits(symmetry: SheetSymmetry, outline: Outline, electrodes: FloatArray) -> bool:
    """Whether it takes the rim to the rim and electrodes to electrodes, up to :data:`NEAR`."""
    gaps = np.linalg.norm(electrodes[:, None] - electrodes, axis=2)
    near = NEAR * float(np.sort(gaps, axis=1)[:, 1].min())
    off = np.linalg.norm(symmetry.moved(electrodes) - electrodes[symmetry.electrodes], axis=1)
    image = symmetry.moved(outline.polyline(outline.length / _RIM_POINTS))
    off_rim = np.linalg.norm(image - outline.point(outline.nearest(image)), axis=1)
    return bool(max(off.max(), off_rim.max()) < near)


@dataclass(frozen=True, eq=False)
class Ambiguity:
    """The symmetries of a sheet that a pattern does not see.

    Attributes
    ----------
    symmetries
        Each gives every place another one with (nearly) the same voltages.
    difference
        By how much the voltages of a place and of its image differ, part of the change that a press
        makes: the median over places, of the symmetry that is told apart least.
    extent
        Of the sheet, m.
    instead
        A pattern, as a skin file names it, that tells all places apart; "" where none was found.
    """

    symmetries: tuple[SheetSymmetry, ...]
    difference: float
    extent: float
    instead: str

    @classmethod
    def of(
        cls,
        symmetries: Sequence[SheetSymmetry],
        outline: Outline,
        electrodes: FloatArray,
        mesh: Mesh,
        jacobian: FloatArray,
    ) -> Ambiguity | None:
        """What is left of ``symmetries`` that a pattern does not see; None where all places differ.

        ``electrodes``: their centres (n, 2) m. ``jacobian`` (n_meas, n_cells), of the pattern on
        ``mesh``, says how nearly symmetric the sheet is with its contacts and its surface.
        """
        apart = [_difference(one, mesh, jacobian) for one in symmetries]
        hard = [one for one, by in zip(symmetries, apart, strict=True) if by < NEAR]
        if not hard:
            return None
        extent = float(np.ptp(outline.polyline(outline.length / _RIM_POINTS), axis=0).max())
        return cls(tuple(hard), min(apart), extent, _telling(outline, electrodes))

    @cached_property
    def text(self) -> str:
        """Which places cannot be told apart, and what to change."""
        how = " or ".join(one.text for one in self.symmetries[:3])
        more = len(self.symmetries) - 3
        how += f" or in {more} more ways" if more > 0 else ""
        change = f"; {self.instead} in [drive] separates them" if self.instead else ""
        if self.difference < _NOTHING:
            by = "the same voltages: no data tell which it is"
        else:
            part = 100 * self.difference
            by = f"voltages that differ by {part:.1g} % of the change: data hardly tell which it is"
        return f"a press, and the same press {how}, give {by}{change}"

    @property
    def least(self) -> float:
        """m: a place nearer than this to its image is not told to have another."""
        return _ASIDE * self.extent

    def elsewhere(self, x: float, y: float) -> tuple[tuple[float, float], ...]:
        """The other places, m, whose press gives the voltages of one at (``x``, ``y``) m."""
        here = np.array([[x, y]])
        places: list[FloatArray] = []
        for one in self.symmetries:
            place = one.moved(here)[0]
            apart = [np.linalg.norm(place - other) for other in (here[0], *places)]
            if min(apart) > self.least:
                places.append(place)
        return tuple((float(u), float(v)) for u, v in places)


_NOTHING = 0.01
"""Meshes are symmetric up to so much of the change."""


def _forms(pattern: Pattern) -> Iterator[FloatArray]:
    """(n, n) of each row: its voltage is ⟨form, Z⟩ for the symmetric transfer impedance Z."""
    for drive, (plus, minus) in zip(pattern.drive_index, pattern.measure, strict=True):
        read = np.zeros(pattern.n_electrodes)
        read[plus], read[minus] = 1.0, -1.0
        one = np.outer(pattern.currents[drive], read)
        yield one + one.T


def _isometry(angle: float, mirrored: bool) -> FloatArray:
    """(2, 2) turn by ``angle`` rad, after a mirror at +x where ``mirrored``."""
    c, s = math.cos(angle), math.sin(angle)
    return np.array([[c, s], [s, -c]]) if mirrored else np.array([[c, -s], [s, c]])


def _fitted(arms: FloatArray, onto: FloatArray, mirrored: bool) -> FloatArray:
    """(2, 2) isometry that takes ``arms`` (n, 2) nearest to ``onto`` (Kabsch 1976)."""
    turned = arms * [1.0, -1.0] if mirrored else arms
    across = turned[:, 0] * onto[:, 1] - turned[:, 1] * onto[:, 0]
    return _isometry(math.atan2(across.sum(), (turned * onto).sum()), mirrored)


def _difference(symmetry: SheetSymmetry, mesh: Mesh, jacobian: FloatArray) -> float:
    """Median, over places, of ‖v(p) − v(g(p))‖ / ‖v(p)‖ of smooth small presses."""
    flat = mesh.points[mesh.cells, :2].mean(axis=1)
    extent = float(np.ptp(mesh.points[:, :2], axis=0).max())
    spread = symmetry.centre + _COMPARED * (flat - symmetry.centre)
    places = spread[:: max(1, len(spread) // 50)]
    own, other = (
        np.asarray(jacobian @ _bumps(flat, mesh.volumes, some, _BUMP * extent))
        for some in (places, symmetry.moved(places))
    )
    return float(np.median(np.linalg.norm(own - other, axis=0) / np.linalg.norm(own, axis=0)))


def _bumps(cells: FloatArray, areas: FloatArray, places: FloatArray, radius: float) -> FloatArray:
    """(n_cells, n_places) changes of conductivity whose area is the same for all."""
    apart = np.linalg.norm(cells[:, None] - places, axis=2)
    bump = np.exp(-((apart / radius) ** 2))
    return np.asarray(bump / (areas @ bump))


def _telling(outline: Outline, electrodes: FloatArray) -> str:
    """A pattern of which no symmetry of the sheet keeps all rows, as a skin file says it."""
    for name in _TRIED:
        with suppress(PatternError):
            if not unseen_symmetries(named(name, len(electrodes)), outline, electrodes):
                return f'pattern = "{name}"'
    return ""
