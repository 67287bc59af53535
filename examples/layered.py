"""A soft body with stiff inclusions under a rigid plate: what the sheet between them feels.

Palpation. The body is springs side by side (:mod:`tomoskin.twin.contact`); an inclusion makes the
springs through it shorter, and lifts the face where the body was not cut out for it. How a force
that acts at a depth is spread over the face is Boussinesq's (1885) solution for a point force, of
which the part 1 − (1 + (a/h)²)^(−3/2) lies within the radius a (Timoshenko & Goodier 1951, § 124).
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from scipy.fft import irfft2, rfft2
from scipy.ndimage import map_coordinates
from scipy.optimize import brentq

from tomoskin.core import FloatArray, GeometryError, ModelError
from tomoskin.model.mesh import Surface
from tomoskin.twin import ContactSettings, Deformation, Grid
from tomoskin.twin.dent import bulge_strain

_NODES = 144
_AROUND = 1.5
"""The grid is so many times as wide as the body."""


@dataclass(frozen=True, slots=True)
class Inclusion:
    """A ball in a soft body.

    Attributes
    ----------
    x, y
        Its middle, m.
    diameter
        m.
    depth
        Of its top below the body's face, m.
    modulus
        Pa; inf is rigid.
    room
        Part of its volume that the body was cut out for: 1, it is cast in; 0, it is laid between
        two layers, which it presses apart.
    """

    x: float
    y: float
    diameter: float
    depth: float
    modulus: float = math.inf
    room: float = 1.0

    def __post_init__(self) -> None:
        """Check the numbers."""
        if not (math.isfinite(self.x) and math.isfinite(self.y)):
            raise GeometryError(
                f"expected a finite position, got {self.x}, {self.y}", where="inclusion"
            )
        if not (0 < self.diameter < math.inf and 0 < self.depth < math.inf):
            raise GeometryError(
                f"expected a diameter and a depth above 0 m, got {self.diameter} and {self.depth}",
                where="inclusion",
            )
        if not (self.modulus > 0 and 0 <= self.room <= 1):
            raise ModelError(
                "expected a modulus above 0 and a fraction from 0 to 1 as room, got "
                f"{self.modulus} Pa and {self.room}",
                where="inclusion",
            )

    def chord(self, grid: Grid) -> FloatArray:
        """(n, n) m: length of each spring that runs through it."""
        away = ((grid.points - (self.x, self.y)) ** 2).sum(axis=1).reshape(grid.n, grid.n)
        return np.asarray(2 * np.sqrt(np.maximum(self.diameter**2 / 4 - away, 0.0)))


@dataclass(frozen=True)
class Layered:
    """A soft body with inclusions; modulus and thickness are those of the contact settings.

    It does not lock: what is pressed here is pressed gently.

    Attributes
    ----------
    contact
        Sheet and body.
    side
        Of the square body around the origin, m.
    inclusions
        None may reach through the bottom, or overlap another seen from above.
    """

    contact: ContactSettings
    side: float
    inclusions: tuple[Inclusion, ...] = ()

    def __post_init__(self) -> None:
        """Refuse inclusions that are not inside, or overlap."""
        thickness = self.contact.thickness
        for number, one in enumerate(self.inclusions):
            where = f"inclusion {number}"
            if max(abs(one.x), abs(one.y)) + one.diameter / 2 > self.side / 2:
                raise GeometryError("it extends beyond the side of the body", where=where)
            if one.depth + one.diameter >= thickness:
                raise GeometryError(
                    f"it extends to a depth of {1e3 * (one.depth + one.diameter):.4g} mm, but "
                    f"the body is {1e3 * thickness:.4g} mm thick",
                    where=where,
                )
            for other in self.inclusions[:number]:
                apart = math.hypot(one.x - other.x, one.y - other.y)
                if apart < (one.diameter + other.diameter) / 2:
                    raise GeometryError("it overlaps another inclusion", where=where)

    @property
    def grid(self) -> Grid:
        """Over the body, and beyond it."""
        return Grid(_NODES, _AROUND * self.side / _NODES)

    def stiffness(self) -> FloatArray:
        """(n, n) Pa/m: rise of the pressure at the face per travel of a rigid plate."""
        plain = self.contact.spring
        return plain + self._spread(lambda spring, _: spring - plain)

    def lift(self) -> FloatArray:
        """(n, n) Pa: pressure at the face when it is held where it would be without inclusions."""
        return self._spread(lambda spring, raised: spring * raised)

    def _spread(self, of: Callable[[FloatArray, FloatArray], FloatArray]) -> FloatArray:
        """Sum over the inclusions of what their columns do, spread over the face.

        ``of`` takes a column's spring, Pa/m, and how far it is raised, m.
        """
        grid, total = self.grid, np.zeros((_NODES, _NODES))
        for one in self.inclusions:
            chord = one.chord(grid)
            foam = self.contact.thickness - one.room * chord
            spring = 1.0 / (foam / self.contact.modulus + chord / one.modulus)
            column = np.where(chord > 0, of(spring, (1 - one.room) * chord), 0.0)
            total += irfft2(rfft2(column) * rfft2(_boussinesq(one.depth, grid)), column.shape)
        return total


@dataclass(frozen=True)
class Plate(Deformation):
    """A rigid square plate on the sheet on a body, pressed with ``force`` N; 0: it is lifted off.

    The sheet lies there loosely: the shape of the face alone does not stretch it.

    Attributes
    ----------
    body
        What lies under the sheet.
    force
        N.
    side
        Of the plate around the origin, m.
    """

    body: Layered
    force: float
    side: float = 90e-3

    def __post_init__(self) -> None:
        """Check the numbers."""
        if not 0 <= self.force < math.inf:
            raise ModelError(f"expected a force of 0 N or more, got {self.force}", where="plate")
        if not 0 < self.side <= self.body.side:
            raise GeometryError(
                f"expected a plate of at most {1e3 * self.body.side:.4g} mm, "
                f"got {1e3 * self.side:.4g} mm",
                where="plate",
            )

    @property
    def travel(self) -> float:
        """How far the plate is below the face of a body without inclusions, m."""
        return _settled(self).travel

    @property
    def pressure(self) -> FloatArray:
        """(n, n) Pa on the nodes of ``body.grid``."""
        return _settled(self).pressure

    def strain(self, uv: FloatArray, rest: Surface, height: float) -> FloatArray:
        """Of the sheet that follows the face, and is carried along by it as it bulges."""
        del rest, height
        return np.asarray(_read(_settled(self).strain, uv, self.body.grid).T)

    def depth(self, uv: FloatArray) -> FloatArray:
        """(n,) m: by the pressure at the face, which is that of an even body pressed so far."""
        even = self.pressure / self.body.contact.spring
        return np.asarray(_read(even[None], uv, self.body.grid)[0])


@dataclass(frozen=True, eq=False)
class _Settled:
    """A plate in balance: travel m; pressure (n, n) Pa; strain (3, n, n)."""

    travel: float
    pressure: FloatArray
    strain: FloatArray


@lru_cache(maxsize=16)
def _settled(plate: Plate) -> _Settled:
    """Travel at which the plate carries its force; what the sheet feels then."""
    body, grid = plate.body, plate.body.grid
    spring, lift = body.stiffness(), body.lift()
    under = (np.abs(grid.points) < plate.side / 2).all(axis=1).reshape(spring.shape)
    cell = plate.side**2 / under.sum()

    def carried(travel: float) -> float:
        return float(np.maximum(spring * travel + lift, 0.0)[under].sum() * cell)

    free = -lift / spring
    if plate.force == 0:
        travel = float(free[under].min())
    else:
        most = 1.001 * plate.force / (body.contact.spring * plate.side**2)
        travel = float(brentq(lambda d: carried(d) - plate.force, float(free.min()), most))
    pressure = np.where(under, np.maximum(spring * travel + lift, 0.0), 0.0)
    strain = bulge_strain(pressure / body.contact.spring, body.contact, grid)
    return _Settled(travel, pressure, strain)


def _read(fields: FloatArray, uv: FloatArray, grid: Grid) -> FloatArray:
    """(k, m) of fields (k, n, n) at points (m, 2) m, linear between the nodes."""
    at = np.asarray(uv).T / grid.step + grid.n // 2
    return np.stack([map_coordinates(one, at, order=1, mode="nearest") for one in fields])


def _boussinesq(depth: float, grid: Grid) -> FloatArray:
    """(n, n) share of a force ``depth`` m below a node that each node of the face gets.

    In the order of a transform; the shares on the grid sum to one.
    """
    x = np.fft.fftfreq(grid.n, 1 / grid.n) * grid.step
    share = (x[:, None] ** 2 + x**2 + depth**2) ** -2.5
    return np.asarray(share / share.sum())
