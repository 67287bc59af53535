"""What probes do to a sheet at any points: each probe's own dent, solved once and moved about."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.fft import irfft2, rfft2
from scipy.ndimage import gaussian_filter, map_coordinates

from tomoskin.core import FloatArray
from tomoskin.model.forward import choose_engine
from tomoskin.twin.contact import BodySurface, ContactSettings, Grid, solve_contact
from tomoskin.twin.probe import Probe, Shape

_NODES = 128
_ROUND = ((0, 0), (_NODES // 2, _NODES // 2), (_NODES // 2, _NODES // 2))
_LEAST_FORCE = 1e-3
_LADDER = math.sqrt(2.0)
"""Dents of a curved face are solved at forces that differ by this factor, and blended."""

_REACHES = 6.0
"""A dent is followed this many reaches beyond the face: a part of e⁻⁶ is left out."""

_SHIFTS = 3.0
"""And the strain along the sheet so many times √(stiffness / shear spring), where it fades out."""


@dataclass(frozen=True, eq=False)
class Dent:
    """The dent of one probe at one force, on a grid of its own.

    Attributes
    ----------
    grid
        Around the shape's origin, along its axes.
    force
        N at which it was solved.
    travel
        Of the probe, on a body that does not lock, m.
    table
        (13, n·n): strain xx, yy, xy by bulging; depth; strain by the slope; by a drag of as many
        newtons as ``force`` along x; and along y.
    """

    grid: Grid
    force: float
    travel: float
    table: FloatArray


@lru_cache(maxsize=256)
def solved_dent(shape: Shape, settings: ContactSettings, force: float, blur: float) -> Dent:
    """The dent of ``shape`` under ``force`` N, evened out over ``blur`` m (standard deviation).

    Even out by the size of the cells that it will be read at: the read values then hold what lies
    between them.
    """
    shift = math.sqrt(settings.stiffness / settings.shear_spring)
    margin = max(_REACHES * settings.reach, _SHIFTS * shift, 4 * blur, 0.25 * shape.extent)
    grid = Grid(_NODES, 2 * (shape.extent + margin) / _NODES)
    probe = Probe(shape, 0.0, 0.0, force)
    dented = solve_contact([probe], settings, grid)
    wide = Grid(2 * _NODES, grid.step)
    depth, pressed = np.pad(np.stack([dented.depth, dented.pressure]), _ROUND)
    still = np.zeros_like(pressed)
    fields = np.concatenate([
        bulge_strain(depth, settings, wide),
        depth[None],
        slope_strain(depth, settings, wide),
        drag_strain(np.stack([pressed, still]), settings, wide),
        drag_strain(np.stack([still, pressed]), settings, wide),
    ])[:, _NODES // 2 : -_NODES // 2, _NODES // 2 : -_NODES // 2]  # fmt: skip
    even = gaussian_filter(fields, (0, blur / grid.step, blur / grid.step), mode="nearest")
    even *= _fading(grid)
    table = even.reshape(len(fields), -1)
    table.flags.writeable = False
    return Dent(grid, force, float(dented.travel[0]), table)


def indent(
    probes: Sequence[Probe], settings: ContactSettings, points: FloatArray, blur: float = 0.0
) -> FloatArray:
    """(4, n) what ``probes`` do to the sheet at ``points`` (n, 2) m.

    Strain xx, yy, xy in the plane of the sheet, and depth in m.

    The dents of several probes add up: exact for their pressures, as the body is linear; a rigid
    face within a few reaches of another would in truth press a little otherwise
    (:func:`solve_contact` solves them together).
    """
    x, y = np.ascontiguousarray(points.T)
    placed = [_placed(probe, settings, blur) for probe in probes if probe.force > 0]
    core = choose_engine().core
    felt: FloatArray = _felt(placed, x, y) if core is None else core.dented(x, y, placed)
    return felt


def depth_under(probe: Probe, settings: ContactSettings, blur: float = 0.0) -> float:
    """M by which the sheet gives way under the ``probe``, wherever its face is lowest."""
    total = 0.0
    for solved_at, weight in _rungs(probe.shape, probe.force):
        dent = solved_dent(probe.shape, settings, solved_at, blur)
        travel = dent.travel * probe.force / solved_at
        total += weight * travel * settings.locked(travel)
    return total


def turned(strain: FloatArray, angle: float) -> FloatArray:
    """(n, 3) xx, yy, xy of tensors given in axes that are turned by ``angle`` rad."""
    return np.asarray(strain @ _turn(angle).T)


def _turn(angle: float) -> FloatArray:
    """(3, 3): xx, yy, xy in axes that are turned by ``angle`` → in those of the sheet."""
    c, s = math.cos(angle), math.sin(angle)
    return np.array([
        [c * c, s * s, -2 * c * s],
        [s * s, c * c, 2 * c * s],
        [c * s, -c * s, c * c - s * s],
    ])  # fmt: skip


class _Placed(NamedTuple):
    """Strain and depth (n·n, 4) of a probe as it presses now, its grid, n, step and reach, and its
    place: x, y, cosine and sine of the angle by which it is turned.

    As the native engine takes it.
    """

    table: FloatArray
    grid: tuple[int, float, float]
    place: tuple[float, float, float, float]


def _placed(probe: Probe, settings: ContactSettings, blur: float) -> _Placed:
    c, s = math.cos(probe.angle), math.sin(probe.angle)
    dx, dy = probe.drag
    along = (c * dx + s * dy, c * dy - s * dx)
    table, grid = _blended(probe.shape, settings, probe.force, along, blur)
    return _Placed(table, grid, (probe.x, probe.y, c, s))


def _felt(placed: Sequence[_Placed], x: FloatArray, y: FloatArray) -> FloatArray:
    """(4, n) strain and depth of all dents together at points (n,), as the native engine has it."""
    total = np.zeros((4, len(x)))
    for table, (n, step, reach), (px, py, c, s) in placed:
        ax, ay = x - px, y - py
        near = np.flatnonzero(ax * ax + ay * ay < reach**2)
        ax, ay = ax[near] / step, ay[near] / step
        at = np.stack([c * ax + s * ay, c * ay - s * ax]) + n // 2
        values = np.stack([map_coordinates(one, at, order=1) for one in table.T.reshape(4, n, n)])
        values[:3] = _turn(math.atan2(s, c)) @ values[:3]
        total[:, near] += values
    return total


@lru_cache(maxsize=64)
def _blended(
    shape: Shape,
    settings: ContactSettings,
    force: float,
    drag: tuple[float, float],
    blur: float,
) -> tuple[FloatArray, tuple[int, float, float]]:
    """Table and grid of :class:`_Placed`: where all is linear from one dent, else between two.
    Either way the force is exact.

    A body that locks makes every dent shallower, in the shape that it has.
    """
    total, grid = np.zeros((4, 1)), Grid(1, 1.0)
    for solved_at, weight in _rungs(shape, force):
        dent = solved_dent(shape, settings, solved_at, blur)
        scale, table = force / solved_at, dent.table
        share = settings.locked(dent.travel * scale)
        mixed = weight * scale * share * table[:4]
        mixed[:3] += weight * (scale * share) ** 2 * table[4:7]
        if drag != (0.0, 0.0):
            mixed[:3] += weight / solved_at * drag[0] * table[7:10]
            mixed[:3] += weight / solved_at * drag[1] * table[10:]
        total, grid = total + mixed, dent.grid
    table = np.ascontiguousarray(total.T)  # a point's values side by side, to be read at once
    table.flags.writeable = False
    return table, (grid.n, grid.step, grid.reach)


def _rungs(shape: Shape, force: float) -> list[tuple[float, float]]:
    """Forces to solve at and their weights: one where all is linear, else two neighbours."""
    if shape.flat:
        return [(1.0, 1.0)]
    most = max(force, _LEAST_FORCE)
    low = math.floor(math.log(most / _LEAST_FORCE, _LADDER))
    below, above = (_LEAST_FORCE * _LADDER**k for k in (low, low + 1))
    part = (most - below) / (above - below)
    return [(below, 1 - part), (above, part)]


def _fading(grid: Grid) -> FloatArray:
    """(n, n) from 1 to 0 over the outer eighth, so that nothing ends with a step."""
    fade = np.clip((1 - np.hypot(*grid.points.T) / grid.reach) * 8, 0.0, 1.0)
    return np.asarray((fade**2 * (3 - 2 * fade)).reshape(grid.n, grid.n))


# How a dent and a drag stretch the sheet in its own plane.

_Waves = NDArray[np.complex128]


def slope_strain(depth: FloatArray, settings: ContactSettings, grid: Grid) -> FloatArray:
    """(3, n, n) strain xx, yy, xy of a sheet that follows a dent: ½∇w∇wᵀ and what it evens out.

    The sheet's plane stress C(ε(u) + ½∇w∇wᵀ) is in balance with the shear of the body below,
    ∇·C(…) = κu (von Kármán's membrane on shear springs κ; Timoshenko & Woinowsky-Krieger 1959,
    chapter 13). Quadratic in the depth.
    """
    qx, qy = grid.wave_numbers
    waves = rfft2(depth)
    wx, wy = (irfft2(1j * q * waves, depth.shape) for q in (qx, qy))
    own = [rfft2(part) for part in (wx * wx / 2, wy * wy / 2, wx * wy / 2)]
    lame, shear = settings.lame
    trace = lame * (own[0] + own[1])
    push_x = 1j * (qx * (trace + 2 * shear * own[0]) + qy * 2 * shear * own[2])
    push_y = 1j * (qx * 2 * shear * own[2] + qy * (trace + 2 * shear * own[1]))
    moved = _strain(*_shift(push_x, push_y, settings, grid), grid)
    return np.stack([irfft2(a + b, depth.shape) for a, b in zip(own, moved, strict=True)])


def bulge_strain(depth: FloatArray, settings: ContactSettings, grid: Grid) -> FloatArray:
    """(3, n, n) strain xx, yy, xy of a sheet that the body's face carries along as it bulges.

    Pressed by w, springs of length t would spread by β w/t in each direction, and a layer as its
    elasticity says (:class:`BodySurface`). The face moves by the gradient field with that
    divergence, and drags the sheet through its shear. Linear in the depth.
    """
    qx, qy = grid.wave_numbers
    squared = qx**2 + qy**2
    face = BodySurface.of(settings, squared)
    squared[0, 0] = 1.0
    spread = face.spread * rfft2(depth) / squared
    pull = [-1j * q * spread * face.along for q in (qx, qy)]
    waves = _strain(*_shift(pull[0], pull[1], settings, grid), grid)
    for part in waves[:2]:
        part[0, 0] = spread[0, 0] / 2  # free to spread: no grid around it holds it back
    return np.stack([irfft2(part, depth.shape) for part in waves])


def drag_strain(traction: FloatArray, settings: ContactSettings, grid: Grid) -> FloatArray:
    """(3, n, n) strain xx, yy, xy under a ``traction`` (2, n, n) Pa along the sheet; linear."""
    shape = traction.shape[1:]
    waves = _strain(*_shift(rfft2(traction[0]), rfft2(traction[1]), settings, grid), grid)
    return np.stack([irfft2(part, shape) for part in waves])


def _shift(fx: _Waves, fy: _Waves, settings: ContactSettings, grid: Grid) -> tuple[_Waves, _Waves]:
    """Displacement that balances a load along the sheet, of shear κ along a wave and across it:
    (κ + (λ + 2μ)q²) u = f along, (κ + μq²) u = f across."""
    qx, qy = grid.wave_numbers
    squared = qx**2 + qy**2
    lame, shear = settings.lame
    face = BodySurface.of(settings, squared)
    squared[0, 0] = 1.0
    across = face.across + shear * squared
    along = face.along + (lame + 2 * shear) * squared
    load = (qx * fx + qy * fy) / squared
    more = load / along - load / across
    return fx / across + qx * more, fy / across + qy * more


def _strain(ux: _Waves, uy: _Waves, grid: Grid) -> tuple[_Waves, _Waves, _Waves]:
    qx, qy = grid.wave_numbers
    return 1j * qx * ux, 1j * qy * uy, 0.5j * (qx * uy + qy * ux)
