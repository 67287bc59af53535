"""A sheet that bends and stretches, on finite elements, strains and laws of its own."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.sparse import csc_matrix
from scipy.sparse.linalg import splu
from scipy.spatial import Delaunay

from report import Floats
from tomoskin import Skin
from touch_lab import uneven_field

HEIGHT = 3e-3
"""m of the sheet above the surface of what bends, which keeps its length: the built-in foam."""

RADIUS, RIM, STEP = 0.1, 192, 4.5e-3
"""Of the disc, m; nodes at its rim; m between those inside."""

UNEVEN, CONTACTS = (0.03, 0.15), 0.1
"""Standard deviations of log σ of a sheet at rest, one drawn for each, and of its contacts'."""

_TWOFOLD = 1.3
"""Exponent of conduction of a plane network above its threshold (Stauffer & Aharony, Introduction
to Percolation Theory, 2nd ed., table 2)."""

PROFILES: dict[str, Callable[[Floats], Floats]] = {
    "hinge": lambda s: np.where(np.abs(s) < 0.5, 1.0, 0.0),
    "cosine": lambda s: np.where(np.abs(s) < 1, (1 + np.cos(np.pi * s)) / 2, 0.0),
    "bell": lambda s: np.exp(-4 * np.log(2) * s**2) * np.sqrt(4 * np.log(2) / np.pi),
    "lopsided": lambda s: np.clip(np.minimum(2 * s + 5 / 3, 7 / 9 - 2 * s / 3), 0.0, None),
}
"""Curvatures across a fold, of unit area, centred and as wide as 1 at half of their height."""


@dataclass(frozen=True)
class Fold:
    """Bent by ``angle`` rad along a line of direction ``axis`` rad, ``offset`` m to its right;
    ``width`` m at half of the curvature, which grows along the line by the part ``taper`` from the
    middle to the rim. Along the line the sheet shrinks by the part ``poisson``."""

    angle: float
    axis: float
    offset: float
    width: float
    profile: str = "hinge"
    poisson: float = 0.0
    taper: float = 0.0

    def strain(self, points: Floats) -> Floats:
        """(n, 2, 2) of the sheet at ``points`` (n, 2) m."""
        along = points @ [np.cos(self.axis), np.sin(self.axis)] / RADIUS
        width = self.width * (1 + self.taper * along)
        across = (points @ _right(self.axis) - self.offset) / width
        size = HEIGHT * self.angle / width * PROFILES[self.profile](across)
        return _directed(-self.poisson * size, size, self.axis)

    def shift(self, points: Floats) -> Floats:
        """(n, 2) m by which the sheet slides over what bends, which stays at the fold."""
        s = np.linspace(-0.25, 0.25, 2001)
        bend = PROFILES[self.profile]((s - self.offset) / self.width) / self.width
        slid = HEIGHT * self.angle * np.cumsum(bend) * (s[1] - s[0])
        slid -= np.interp(self.offset, s, slid)
        right = _right(self.axis)
        return np.asarray(np.interp(points @ right, s, slid)[:, None] * right)


@dataclass(frozen=True)
class Wrap:
    """On a cylinder of ``radius`` m whose axis has the direction ``axis``, over ``length`` m of the
    sheet and fading out beyond."""

    radius: float
    axis: float
    length: float

    def strain(self, points: Floats) -> Floats:
        """See :class:`Fold`."""
        across = points @ _right(self.axis) / self.length
        size = HEIGHT / self.radius * 2.0 ** -((2 * across) ** 8)
        return _directed(0 * size, size, self.axis)


@dataclass(frozen=True)
class Stretch:
    """Longer by the part ``along`` in the direction ``axis`` rad, by ``across`` at right angles."""

    along: float
    across: float
    axis: float

    def strain(self, points: Floats) -> Floats:
        """See :class:`Fold`."""
        one = np.ones(len(points))
        return _directed(self.along * one, self.across * one, self.axis)


Pose = Fold | Wrap | Stretch


def _right(axis: float) -> Floats:
    return np.array([np.sin(axis), -np.cos(axis)])


def _directed(along: Floats, across: Floats, axis: float) -> Floats:
    d, r = np.array([np.cos(axis), np.sin(axis)]), _right(axis)
    return np.asarray(
        along[:, None, None] * np.outer(d, d) + across[:, None, None] * np.outer(r, r)
    )


@dataclass(frozen=True)
class Affine:
    """What conducts keeps its resistivity and its volume: only the dimensions change.

    A square of the sheet at rest then conducts 1/λ² as well in a direction in which it is longer by
    the factor λ, since it is longer, narrower and thinner.
    """

    def __call__(self, longer: Floats, beside: Floats) -> Floats:
        """Factors on the conductance in the direction of a principal elongation ``longer``, with
        another ``beside`` it."""
        del beside
        return np.asarray((1 + longer) ** -2)


@dataclass(frozen=True)
class Percolating:
    """Contacts between threads or particles open as the sheet is stretched, towards a threshold.

    σ ~ (p − p_c)^t (Carmona, Canet & Delhaes 1987, J. Appl. Phys. 61, 2550; of bonds in directions,
    Grimaldi et al. 2003, Phys. Rev. B 68, 024207), where a strain of 1/``rate`` would open the last
    contact; the part ``share`` of them lies in the direction of the strain.
    """

    rate: float
    share: float

    def __call__(self, longer: Floats, beside: Floats) -> Floats:
        """See :class:`Affine`; its thickness stays."""
        felt = self.share * longer + (1 - self.share) * beside
        left = np.maximum(1 - self.rate * felt, 0.02) ** _TWOFOLD
        return np.asarray(left * (1 + beside) / (1 + longer))


Law = Affine | Percolating


@dataclass(frozen=True)
class Ball:
    """A ball that presses with ``force`` N: Hertz's pressure lowers the conductance, at 4 N by the
    part ``fall`` in its middle, and the sheet is stretched around it (Johnson, Contact Mechanics,
    1985, 4.2)."""

    x: float
    y: float
    force: float
    fall: float

    @property
    def radius(self) -> float:
        """Of the contact, m."""
        return 0.012 * float(np.cbrt(self.force / 4))

    def left(self, points: Floats, part: float) -> Floats:
        """(n,) factors on the conductance with the part ``part`` of its response."""
        away = np.linalg.norm(points - [self.x, self.y], axis=1) / self.radius
        under = np.sqrt(np.clip(1 - away**2, 0.0, None))
        around = 0.25 * np.exp(-3 * np.abs(away - 1))
        return np.asarray(1 - self.fall * part * np.cbrt(self.force / 4) * (under + around))


class Sheet:
    """A disc of linear triangles in rings; electrodes may begin anywhere at its rim.

    Complete electrode model (Somersalo, Cheney & Isaacson 1992, SIAM J. Appl. Math. 52, 1023) in
    the sheet at rest: deformed, it conducts as a tensor there.
    """

    def __init__(self, skin: Skin, seed: int) -> None:
        random = np.random.default_rng([seed, 5])
        self.points = _rings()
        cells = Delaunay(self.points).simplices
        corners = self.points[cells]
        edge = corners[:, [2, 0, 1]] - corners[:, [1, 2, 0]]
        twice = edge[:, 0, 0] * edge[:, 1, 1] - edge[:, 0, 1] * edge[:, 1, 0]
        slopes = np.stack([-edge[..., 1], edge[..., 0]], -1) / twice[:, None, None]
        i, j = np.repeat(cells, 3, axis=1).ravel(), np.tile(cells, 3).ravel()
        self._at = i, j
        self._pairs = (
            np.abs(twice)[:, None, None, None, None]
            / 2
            * np.einsum("cia,cjb->cijab", slopes, slopes)
        )
        inner = np.array([[4, 1, 1], [1, 4, 1], [1, 1, 4]]) / 6
        self.inner = np.einsum("qk,ckd->cqd", inner, corners)
        field = uneven_field(corners.mean(axis=1), random)
        self.sigma = skin.conductivity * np.exp(random.uniform(*UNEVEN) * field)
        x, y = skin.electrode_centres.T
        self.middles = np.arctan2(y, x)
        self.half = skin.arcs[0].width(skin.outline) / 2 / RADIUS
        self.contact = skin.contact_impedance * np.exp(CONTACTS * random.standard_normal(len(x)))

    def conductance(self, law: Law, strain: Floats, left: Floats) -> Floats:
        """(n_cells, 2, 2) S of the cells, of strain (n_cells, 3, 2, 2) and ``left`` (n_cells, 3) of
        a press at each cell's inner points."""
        xx, yy, xy = strain[..., 0, 0], strain[..., 1, 1], strain[..., 0, 1]
        mean, half = (xx + yy) / 2, (xx - yy) / 2
        size = np.hypot(half, xy)
        first, second = left * law(mean + size, mean - size), left * law(mean - size, mean + size)
        even, odd = (first + second) / 2, (first - second) / 2 / np.maximum(size, 1e-12)
        parts = np.array([even + odd * half, odd * xy, odd * xy, even - odd * half]).mean(axis=2)
        return np.asarray((self.sigma * parts).T.reshape(-1, 2, 2))

    def resistance(
        self, tensor: Floats, turned: Floats | float = 0.0, worse: Floats | float = 1.0
    ) -> Floats:
        """(n, n) Ω between the electrodes, which stand ``turned`` rad further along the rim, and
        whose contacts are so many times ``worse``."""
        n, (i, j) = len(self.points), self._at
        values = np.einsum("cijab,cab->cij", self._pairs, tensor).ravel()
        rim, sides, sizes = self._electrodes(turned, self.contact * worse)
        i, j = np.concatenate([i, rim[0]]), np.concatenate([j, rim[1]])
        system = csc_matrix((np.concatenate([values, rim[2]]), (i, j)), (n, n))
        fields = splu(system, permc_spec="MMD_AT_PLUS_A", options={"SymmetricMode": True})
        schur = np.diag(sizes) - sides.T @ fields.solve(sides)
        return np.asarray(np.linalg.inv(schur + 1.0))  # what all potentials have in common is free

    def _electrodes(
        self, turned: Floats | float, contact: Floats
    ) -> tuple[tuple[Floats, ...], Floats, Floats]:
        """Entries of ∫ uv/z over the rim's edges, (n, n_el) ∫ v/z, (n_el,) ∫ 1/z."""
        nodes, step = np.arange(RIM), 2 * np.pi / RIM
        begin = (self.middles + turned - self.half)[:, None] / step - nodes
        begin = (begin + RIM / 2) % RIM - RIM / 2
        low, high = np.clip(begin, 0.0, 1.0), np.clip(begin + 2 * self.half / step, 0.0, 1.0)
        edge = 2 * RADIUS * np.sin(step / 2) / contact[:, None]
        one, first, second = (edge * (high**k - low**k) / k for k in (1, 2, 3))
        ends = nodes, np.roll(nodes, -1)
        sides = np.zeros((len(self.points), len(self.middles)))
        np.add.at(sides, ends[0], (one - first).T)
        np.add.at(sides, ends[1], first.T)
        mass = [(one - 2 * first + second), first - second, first - second, second]
        rows = np.concatenate([ends[a] for a in (0, 0, 1, 1)])
        columns = np.concatenate([ends[b] for b in (0, 1, 0, 1)])
        return (
            (rows, columns, np.concatenate([m.sum(axis=0) for m in mass])),
            sides,
            one.sum(axis=1),
        )


def _rings() -> Floats:
    """(n, 2) m: the rim's nodes first, in order; then rings that become coarser inwards."""
    rim = 2 * np.pi * np.arange(RIM) / RIM
    rings = [RADIUS * np.column_stack([np.cos(rim), np.sin(rim)])]
    radius, size = RADIUS, 2 * np.pi * RADIUS / RIM
    while radius > STEP:
        radius -= 0.87 * size
        size = min(1.15 * size, STEP)
        turn = 2 * np.pi * (np.arange(n := max(round(2 * np.pi * radius / size), 1)) / n)
        turn += 0.5 * len(rings)
        rings.append(max(radius, 0.0) * np.column_stack([np.cos(turn), np.sin(turn)]))
    return np.concatenate(rings)


def strain_of(poses: Sequence[Pose], points: Floats) -> Floats:
    """(n, 2, 2) of all together."""
    return sum((pose.strain(points) for pose in poses), np.zeros((len(points), 2, 2)))
