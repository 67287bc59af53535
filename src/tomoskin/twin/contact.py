"""Rigid probes on a stretched sheet over an elastic body: dents and pressures on a grid."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.fft import irfft2, rfft2

from tomoskin.core import FloatArray, GeometryError, IntArray, ModelError
from tomoskin.twin.parameters import check_numbers, parameter
from tomoskin.twin.probe import Probe

_ROUNDS = 2000
_TOLERANCE = 1e-8

FOUNDATIONS = ("winkler", "layer")
"""Bodies under the sheet: springs side by side, or an elastic layer glued to a stiff base."""

_DEEP = 300.0
"""A layer of so many wave lengths over 2π is a half-space: hyperbolic functions end there."""

_LONG = 1e-3
"""Waves longer than the layer's thickness by this part are even pressure."""


@dataclass(frozen=True, slots=True)
class ContactSettings:
    """Sheet, and the soft body under it."""

    foundation: str = parameter("winkler", "", "Model of the body under the sheet.", "")
    modulus: float = parameter(
        5e3,
        "Pa",
        "Compressive modulus of springs, Young's modulus of a layer.",
        "soft polyurethane foam, assumed",
    )
    thickness: float = parameter(3e-3, "m", "Its thickness.", "thin foam, assumed")
    lock: float = parameter(
        0.4, "", "Compression at which the body is squeezed solid (inf: never).", "assumed"
    )
    poisson: float = parameter(0.0, "", "Poisson ratio of the body.", "open foam: about 0, assumed")
    tension: float = parameter(60.0, "N/m", "Tension of the sheet.", "assumed")
    stiffness: float = parameter(
        150.0, "N/m", "Young's modulus of the sheet times thickness.", "stretchy knit, assumed"
    )
    sheet_poisson: float = parameter(0.3, "", "Poisson ratio of the sheet.", "assumed")
    bulge: float = parameter(
        0.2,
        "",
        "Strain along the face of springs per compression across it; a layer has its own.",
        "assumed",
    )
    grip: float = parameter(
        1.0, "", "Part of the body's shear that the sheet feels: 0 where it slips.", "assumed"
    )
    friction: float = parameter(0.3, "", "Sliding friction of a probe.", "assumed")
    rolling_friction: float = parameter(0.02, "", "Rolling friction of a probe.", "assumed")

    def __post_init__(self) -> None:
        """Check the foundation and the range of every number."""
        if self.foundation not in FOUNDATIONS:
            raise ModelError(f"expected a foundation of {FOUNDATIONS}, got {self.foundation!r}")
        check_numbers(
            self,
            above="modulus thickness",
            least="poisson tension stiffness sheet_poisson bulge grip friction rolling_friction",
        )
        if not self.lock > 0:
            raise ModelError(f"expected lock above 0, got {self.lock}", where="ContactSettings")
        if self.poisson > 0.5:
            raise ModelError(
                f"expected poisson of 0.5 or less, got {self.poisson}", where="ContactSettings"
            )

    @property
    def spring(self) -> float:
        """Stiffness per area, Pa/m: modulus over thickness."""
        return self.modulus / self.thickness

    @property
    def shear_modulus(self) -> float:
        """Shear modulus of the body, Pa."""
        return self.modulus / (2 * (1 + self.poisson))

    @property
    def shear_spring(self) -> float:
        """Stiffness per area against shifting the whole sheet along the body, Pa/m."""
        return self.shear_modulus / self.thickness

    @property
    def lame(self) -> tuple[float, float]:
        """λ and μ of the sheet's plane stress, N/m."""
        nu = self.sheet_poisson
        shear = self.stiffness / (2 * (1 + nu))
        return self.stiffness * nu / (1 - nu**2), shear

    def locked(self, travel: float) -> float:
        """Part that is left of a ``travel`` m which a linear body would give way by.

        1/(1 + travel/limit), with the limit at the compression of ``lock``: linear at small
        forces, and never beyond the limit (foams densify: Gibson & Ashby 1997, chapter 5).
        """
        return 1.0 / (1.0 + travel / (self.lock * self.thickness))

    @property
    def reach(self) -> float:
        """How far a dent reaches beyond a probe, m: √(tension / spring), and into a layer."""
        stiff = math.sqrt(self.tension / self.spring)
        return stiff if self.foundation == "winkler" else math.hypot(stiff, self.thickness / 2)


class BodySurface(NamedTuple):
    """What the face of a body does under waves of pressure and shear, wave by wave.

    Attributes
    ----------
    give
        m/Pa of depth, with the sheet on it.
    spread
        1/m: divergence of the face's own motion along itself, per m of depth.
    along, across
        Pa/m of shear, along the wave and across it.
    """

    give: FloatArray
    spread: FloatArray | float
    along: FloatArray | float
    across: FloatArray | float

    @classmethod
    def of(cls, body: ContactSettings, squared: FloatArray) -> BodySurface:
        """Of waves with ``squared`` wave numbers, rad²/m².

        Springs side by side; or a layer glued to a stiff base and to the sheet. In a half-space
        a wave of pressure p gives way by (1 − ν)p/Gq and pulls the face together by (1 − 2ν)p/2Gq
        (Johnson 1985, section 2.8); the plane-strain solution of a layer is the same but for
        functions of qt (Barthel & Perriot 2007, J. Phys. D 40, 1059). Across the wave it is sheared
        as a plate, Gq/tanh qt. The sheet holds the face back, and spans the dent by its tension.
        """
        if body.foundation == "winkler":
            give = 1.0 / (body.spring + body.tension * squared)
            shear = body.grip * body.shear_spring
            return cls(give, 2 * body.bulge / body.thickness, shear, shear)
        x = np.maximum(np.sqrt(squared) * body.thickness, _LONG)
        q, nu, shear = x / body.thickness, body.poisson, body.shear_modulus
        sinh, cosh = np.sinh(np.minimum(x, _DEEP)), np.cosh(np.minimum(x, _DEEP))
        kappa = 3 - 4 * nu
        size = (kappa * cosh**2 + x**2 + (1 - 2 * nu) ** 2) * shear * q
        normal = (1 - nu) * (kappa * sinh * cosh - x) / size
        tangential = (1 - nu) * (kappa * sinh * cosh + x) / size
        inward = ((1 - 2 * nu) * kappa * sinh**2 - x**2) / (2 * size)
        lame, own = body.lame
        held = (lame + 2 * own) * squared
        net = normal - inward**2 * held * body.grip / (1 + held * tangential)
        return cls(
            give=net / (1 + body.tension * squared * net),
            spread=-q * inward / net,
            along=body.grip / tangential,
            across=body.grip * shear * q / np.tanh(x),
        )


@dataclass(frozen=True, slots=True)
class Grid:
    """Square grid of ``n`` × ``n`` nodes ``step`` m apart around the origin."""

    n: int
    step: float

    @property
    def reach(self) -> float:
        """Radius of the largest circle around the origin with nodes all around it, m."""
        return (self.n // 2 - 1) * self.step

    @property
    def points(self) -> FloatArray:
        """(n·n, 2) m; x changes slowest."""
        x = (np.arange(self.n) - self.n // 2) * self.step
        return np.stack(np.meshgrid(x, x, indexing="ij"), axis=-1).reshape(-1, 2)

    @property
    def wave_numbers(self) -> tuple[FloatArray, FloatArray]:
        """(n, 1) and (1, n//2 + 1) rad/m, those of a real transform."""
        qx = 2 * np.pi * np.fft.fftfreq(self.n, self.step)
        qy = 2 * np.pi * np.fft.rfftfreq(self.n, self.step)
        return np.asarray(qx[:, None]), np.asarray(qy[None, :])


@dataclass(frozen=True, eq=False)
class Dented:
    """What probes do to a sheet, on a grid.

    Attributes
    ----------
    grid
        Where.
    depth
        (n, n) m.
    pressure
        (n, n) Pa under the faces, what all probes press together.
    travel
        (n_probes,) m that each probe has moved.
    """

    grid: Grid
    depth: FloatArray
    pressure: FloatArray
    travel: FloatArray

    @property
    def stored(self) -> float:
        """Elastic energy, J: half of pressure times depth."""
        return float((self.pressure * self.depth).sum() * self.grid.step**2 / 2)


def local_points(probe: Probe, points: FloatArray) -> FloatArray:
    """``points`` (n, 2) in the coordinates of the probe's shape."""
    c, s = math.cos(probe.angle), math.sin(probe.angle)
    return np.asarray((points - (probe.x, probe.y)) @ np.array([[c, -s], [s, c]]))


def solve_contact(probes: Sequence[Probe], settings: ContactSettings, grid: Grid) -> Dented:
    """All ``probes`` together on one sheet, each with exactly its force.

    The depth is the pressure p ≥ 0 on the faces times the body's compliance,

        springs with a membrane: T∇²w − kw = −p;      a layer: :class:`BodySurface`,

    and each face is w = travel − gap where it presses, w ≥ travel − gap elsewhere. Conjugate
    gradients on the pressure with the forces kept (Polonsky & Keer 1999, Wear 231, 206). The
    sheet is taken as endless, and what presses as repeating beyond the grid.

    Raises
    ------
    GeometryError
        When a face covers no node of the grid, or two faces overlap.
    ModelError
        When the iteration does not converge.
    """
    faces = _faces(probes, grid)
    depth_of = _compliance(settings, grid)
    shape = (grid.n, grid.n)
    owner = np.full(shape, -1).ravel()
    gap = np.zeros(owner.size)
    for number, (nodes, height) in enumerate(faces):
        if (owner[nodes] >= 0).any():
            other = int(owner[nodes].max())
            raise GeometryError(
                "the faces of the two probes overlap: move them apart",
                where=f"press {other} and press {number}",
            )
        owner[nodes], gap[nodes] = number, height
    nodes = np.flatnonzero(owner >= 0)
    owner, gap = owner[nodes], gap[nodes]
    force = np.array([probe.force for probe in probes]) / grid.step**2

    def depth_at(pressure: FloatArray) -> FloatArray:
        return depth_of(_spread(pressure, nodes, shape)).ravel()[nodes]

    pressure = _spread(_balance(owner, gap, force, depth_at), nodes, shape)
    depth = depth_of(pressure)
    touching = pressure.ravel()[nodes] > 0
    travel = _means(depth.ravel()[nodes] + gap, owner, touching, len(probes))
    return Dented(grid, depth, pressure, travel)


def _balance(
    owner: IntArray, away: FloatArray, force: FloatArray, depth: Callable[[FloatArray], FloatArray]
) -> FloatArray:
    """(n_nodes,) Pa that keeps every face in balance, at nodes whose ``owner`` is a face that is
    ``away`` m from the sheet there; ``force`` of each over the area of a node, and p → w."""
    n = len(force)
    pressure = (force / np.bincount(owner, minlength=n))[owner]
    if not force.any():
        return pressure
    scale = pressure.max()
    step, last, fresh = np.zeros_like(pressure), 1.0, 0.0
    for _ in range(_ROUNDS):
        touching = pressure > 0
        gap = depth(pressure) + away
        gap -= _means(gap, owner, touching, n)[owner]
        size = float((gap[touching] ** 2).sum())
        step = np.where(touching, gap + fresh * size / last * step, 0.0)
        last = size or 1.0
        bent = depth(step)
        bent -= _means(bent, owner, touching, n)[owner]
        slope = float((bent * step)[touching].sum())
        if slope <= 0:
            return pressure
        length = float((gap * step)[touching].sum()) / slope
        before, pressure = pressure, np.maximum(pressure - length * step, 0.0)
        newly = (pressure == 0) & (gap < 0)
        fresh = 0.0 if newly.any() else 1.0
        pressure[newly] -= length * gap[newly]
        total = np.bincount(owner, pressure, n)
        pressure *= np.where(total > 0, force / np.where(total > 0, total, 1.0), 0.0)[owner]
        if np.abs(pressure - before).sum() <= _TOLERANCE * scale * len(pressure):
            return pressure
    raise ModelError(
        f"the contact did not converge in {_ROUNDS} iterations",
        hint="use a coarser or a smaller grid",
    )


def _means(values: FloatArray, owner: IntArray, touching: NDArray[np.bool_], n: int) -> FloatArray:
    """(n,) mean over the nodes of each face that touch."""
    count = np.bincount(owner, touching, n)
    return np.asarray(np.bincount(owner, values * touching, n) / np.maximum(count, 1.0))


def _faces(probes: Sequence[Probe], grid: Grid) -> list[tuple[IntArray, FloatArray]]:
    points = grid.points
    faces = []
    for number, probe in enumerate(probes):
        gap = probe.shape.gap(local_points(probe, points))
        nodes = np.flatnonzero(np.isfinite(gap))
        if not len(nodes):
            raise GeometryError(
                f"its face covers no node of the grid with steps of {grid.step * 1e3:.3g} mm",
                where=f"press {number}",
                hint="use a finer grid",
            )
        faces.append((nodes, gap[nodes] - gap[nodes].min()))
    return faces


def _spread(values: FloatArray, nodes: IntArray, shape: tuple[int, int]) -> FloatArray:
    full = np.zeros(shape)
    full.ravel()[nodes] = values
    return full


def _compliance(settings: ContactSettings, grid: Grid) -> Callable[[FloatArray], FloatArray]:
    """Pressure (n, n) Pa → depth (n, n) m."""
    qx, qy = grid.wave_numbers
    give = BodySurface.of(settings, qx**2 + qy**2).give
    return lambda p: np.asarray(irfft2(rfft2(p) * give, p.shape))
