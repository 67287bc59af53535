"""What stands for the exact model live, and how wrong that may be.

That is the table of what one spot does, and what spots do to each other: the change by all of them
beyond that by each alone. One spot scatters the field that another one has scattered. To second
order that is −FₐᵀΓₐᵦFᵦ and its transpose: F is the field of each electrode times what a spot
changes, Γ the field in one patch of the sheet by a dipole in another. Each in patches a few cells
large, in which a field counts as even. A spot's own reaction is in the logarithm of its
conductivity: for a round one that is exact to second order (Maxwell 1873, article 314, in the
plane).

How far both are from the exact model is measured at spots at random. What is said holds for 19 of
20 spots and pairs.
"""

from __future__ import annotations

import math
from collections.abc import Generator
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array, vstack
from scipy.spatial import cKDTree

from tomoskin.core import Arrays, FloatArray, IntArray, finished
from tomoskin.model.forward import State
from tomoskin.sensing.fit import spot
from tomoskin.sensing.fit.profile import FILLING, Profile
from tomoskin.sensing.fit.spot_fit import SpotPrior
from tomoskin.sensing.fit.table import ResponseTable

_PATCHES = 120
"""Of the sheet, about."""

_ABREAST = 128
"""Columns of the inverse that are held at a time."""


@dataclass(frozen=True, eq=False)
class Interaction:
    """The fields in patches of a sheet.

    Attributes
    ----------
    state, profile
        Of the sheet and its spots.
    centres
        (p, 2) m of the patches.
    spread
        m², the mean second moment of a patch: it is added to a spot's.
    fields
        (p, 2, n_electrodes) of 1 A into each electrode, scaled by √(area · conductivity).
    between
        (2p, 2p) of dipoles in all patches, in the same measure; patch by patch. Both in single
        precision: they are read through in a frame.
    """

    state: State
    profile: Profile
    centres: FloatArray
    spread: float
    fields: NDArray[np.float32]
    between: NDArray[np.float32]

    @classmethod
    def making(cls, response: spot.Response) -> Generator[None, None, Self]:
        """Some ten milliseconds of work for a mesh of 1,500 cells, a piece between two yields."""
        state = response.state
        mesh, sigma = state.model.mesh, np.asarray(state.conductivity)
        patch, centres, area = _patches(mesh.centroids, mesh.volumes)
        n, part = len(sigma), np.sqrt(mesh.volumes / area[patch])
        mean = csr_array((part, (patch, np.arange(n))), shape=(len(area), n))
        root = np.sqrt(mean.power(2) @ sigma)
        gradient = state.model.gradient
        across = vstack([mean @ gradient[:n], mean @ gradient[n:]]).tocsr()
        carried = yield from _carried(state, across)
        yield
        between = carried.reshape(2, len(area), 2, len(area)).transpose(1, 0, 3, 2)
        between = between * root[:, None, None, None] * root[:, None]
        fields = np.stack([(mean @ state.gradient[:, axis].T) for axis in (0, 1)], axis=1)
        spread = 4 * float(area.mean()) / 12
        shape = 2 * len(area), 2 * len(area)
        return cls(
            state,
            response.spots.profile,
            centres,
            spread,
            (root[:, None, None] * fields).astype(np.float32),
            between.reshape(shape).astype(np.float32),
        )

    def change(self, spots: FloatArray) -> FloatArray:
        """(n_meas,) V of spots (k, 4) together, less what each does alone."""
        heights, n = self._heights(spots).astype(np.float32), self.fields.shape[2]
        total = np.zeros((n, n), np.float32)
        before: list[tuple[IntArray, NDArray[np.float32]]] = []
        for height in heights:
            own = np.flatnonzero(height)  # few: beyond a spot's reach there is nothing to multiply
            scattered = (height[own, None, None] * self.fields[own]).reshape(-1, n)
            axes = np.add.outer(2 * own, (0, 1)).ravel()
            for others, earlier in before:
                total += earlier.T @ (self.between[others[:, None], axes] @ scattered)
            before.append((axes, scattered))
        return self.state.model.voltages(total + total.T)

    def _heights(self, spots: FloatArray) -> FloatArray:
        """(k, p) change of the logarithm of the conductivity of each patch by each spot."""
        square = np.exp(2 * spots[:, spot.LOG_RADIUS]) + self.spread
        away = self.centres - spots[:, None, :2]
        far = np.einsum("kpd,kpd->kp", away, away) / (self.profile.reach**2 * square[:, None])
        return self.profile.at(far) * (spots[:, spot.CONTENT] / (FILLING * square))[:, None]


def _patches(centroids: FloatArray, volumes: FloatArray) -> tuple[IntArray, FloatArray, FloatArray]:
    """(n_cells,) the patch of each cell; (p, 2) m and (p,) m²: their centres and areas."""
    step = math.sqrt(float(volumes.sum()) / _PATCHES)
    low, high = centroids.min(axis=0), centroids.max(axis=0)
    x, y = np.meshgrid(*(np.arange(a, b + step, step) for a, b in zip(low, high, strict=True)))
    x[1::2] += step / 2
    _, nearest = cKDTree(np.column_stack([x.ravel(), y.ravel()])).query(centroids)
    _, inverse = np.unique(nearest, return_inverse=True)
    patch = np.asarray(inverse, dtype=np.int64)
    area = np.asarray(np.bincount(patch, volumes), dtype=np.float64)
    sums = [np.bincount(patch, volumes * column) for column in centroids.T]
    return patch, np.stack(sums, axis=1) / area[:, None], area


def _carried(state: State, across: csr_array) -> Generator[None, None, FloatArray]:
    """(m, m): ``across`` (m, n_nodes) on both sides of the inverse of the sheet's matrix."""
    n_nodes = across.shape[1]
    through = np.empty(across.shape)
    for first in range(0, n_nodes, _ABREAST):
        yield
        nodes = np.arange(first, min(first + _ABREAST, n_nodes))
        through[:, nodes] = across @ state.factor.columns(nodes)[:n_nodes]
    yield
    return np.asarray(across @ through.T)


_SPOTS, _PAIRS = 240, 60
_SEED = 27

_DEPTHS = 0.05, 1.0
"""Of the spots, least and most, whatever their sign."""

_MOVED = 40
"""Spots that tell of an uneven sheet's table."""

_RIM = 0.12
"""By which part of the distance between electrodes a press at the very rim is misplaced, as a
standard deviation: on the twin's textile presses are found 1 to 4 mm too far inside."""

_APART = 1.5
"""Median radii that two spots of a pair are apart, at the least."""

_NEIGHBOURS = 16
"""Spots that tell of one between them."""

_HELD = 0.95
"""Part of all spots, and of all pairs, whose error is no more than is said."""


@dataclass(frozen=True, eq=False)
class Certificate:
    """Errors at some spots, and what follows for others.

    Attributes
    ----------
    spots
        (n, 4), in no order.
    like
        (n, 2) of each spot: how far it is from the rim, in median radii, and the logarithm of its
        radius in these. Errors are those of what the sheet's end does, and of what is steep.
    parts
        (n,) error of the table, in parts of what each spot changes.
    margin
        So many times what its neighbours show, the error of a spot is at the most.
    pair
        Error of the interaction of two spots in parts of that, at the most.
    moved
        Error beside, in parts of each change, of a table that was moved to an uneven sheet.
    """

    spots: FloatArray
    like: FloatArray
    parts: FloatArray
    margin: float
    pair: float
    moved: float = 0.0

    @classmethod
    def of(
        cls,
        response: spot.Response,
        table: ResponseTable,
        prior: SpotPrior,
        transfers: FloatArray,
        of_pairs: FloatArray,
    ) -> Self:
        """By what the exact model says of :func:`trial_spots`: (n, q) and (m, q) Ω, each alone and
        in pairs, see :meth:`~tomoskin.sensing.fit.spot.Response.transfers`."""
        spots, pairs = trial_spots(response, prior, table.sign)
        alone = transfers @ response.by_transfer
        parts = _norms(alone - table.expanded(spots)[:, 0] @ table.basis) / _norms(alone)
        beyond = of_pairs @ response.by_transfer - alone[pairs].sum(axis=1)
        interaction = finished(Interaction.making(response))
        said = np.array([interaction.change(spots[pair]) for pair in pairs])
        pair = float(np.quantile(_norms(beyond - said) / _norms(said), _HELD))
        like = Rim.of(response, prior).like(spots)
        bare = cls(spots, like, parts, 1.0, pair)
        around = bare._around(like, first=1)  # the nearest is a spot itself
        return replace(bare, margin=float(np.quantile(parts / around, _HELD)))

    @classmethod
    def unpacked(cls, arrays: Arrays) -> Self:
        """Of the arrays that :meth:`packed` made."""
        margin, pair = arrays["certified"].tolist()
        spots, like, parts = (arrays[f"certified_{name}"] for name in ("spots", "like", "parts"))
        return cls(spots, like, parts, margin, pair)

    def packed(self) -> Arrays:
        """All that the certificate holds, in arrays."""
        return {
            "certified": np.array([self.margin, self.pair]),
            "certified_spots": self.spots,
            "certified_like": self.like,
            "certified_parts": self.parts,
        }

    def adapted(
        self, response: spot.Response, table: ResponseTable
    ) -> Generator[None, None, Certificate]:
        """That of the ``table`` of ``response``, another sheet on the same mesh, a piece between
        two yields."""
        wrong: list[float] = []
        for some in np.array_split(self.spots[:_MOVED], _MOVED // 3):
            yield
            alone = response.changes(list(some[:, None]))
            lacks = alone - table.expanded(some)[:, 0] @ table.basis
            wrong += (_norms(lacks) / _norms(alone)).tolist()
        beside = np.square(wrong) - self.parts[:_MOVED] ** 2
        return replace(self, moved=float(np.sqrt(max(beside.mean(), 0.0))))

    def error(self, like: FloatArray, sizes: FloatArray) -> float:
        """What the table lacks of k spots, at the most, as a rule.

        ``like`` (k, 2) as :meth:`Rim.like` has it. In the measure of the ``sizes`` (k,) of what
        each changes. Errors have nothing to do with each other.
        """
        each = self.margin * np.hypot(self._around(like, first=0), self.moved) * sizes
        return float(np.linalg.norm(each))

    def _around(self, like: FloatArray, first: int) -> FloatArray:
        """(k,) root mean square of the errors of spots (k, 2) like these, from the ``first`` on."""
        _, near = self._tree.query(like, _NEIGHBOURS + first)
        own = np.asarray(near)[:, first:]
        return np.asarray(np.sqrt(np.mean(self.parts[own] ** 2, axis=1)))

    @cached_property
    def _tree(self) -> cKDTree:
        return cKDTree(self.like)


@dataclass(frozen=True, eq=False)
class Rim:
    """Where a sheet ends: points (n, 2) m in a ``tree``; ``radius``: a spot's median one, m;
    ``spacing``: from electrode to electrode, m."""

    tree: cKDTree
    radius: float
    spacing: float

    @classmethod
    def of(cls, response: spot.Response, prior: SpotPrior) -> Self:
        """Corners and middles of the facets at the rim."""
        mesh = response.spots.mesh
        ends = mesh.points[mesh.boundary]
        points = np.concatenate([ends.reshape(-1, 2), ends.mean(axis=1)])
        length = float(np.linalg.norm(np.diff(ends, axis=1), axis=-1).sum())
        spacing = length / response.state.model.pattern.n_electrodes
        return cls(cKDTree(points), prior.radius, spacing)

    def doubt(self, x: float, y: float, radius: float) -> FloatArray:
        """(2, 2) m² by which a press near the rim is misplaced towards the middle or away from it,
        since the sheet yields there in another way than a round spot does."""
        every = self.tree.data - (x, y)  # of a single spot faster than by the tree
        square = every[:, 0] ** 2 + every[:, 1] ** 2
        nearest = int(square.argmin())
        away, out = math.sqrt(square[nearest]), every[nearest]
        variance = (_RIM * self.spacing * math.exp(-((away / radius) ** 2))) ** 2
        return np.asarray(variance / max(away * away, 1e-12) * np.outer(out, out))

    def like(self, spots: FloatArray) -> FloatArray:
        """(k, 2) see :attr:`Certificate.like`, of spots (k, 4)."""
        away, _ = self.tree.query(spots[:, :2])
        return np.column_stack(
            [away / self.radius, spots[:, spot.LOG_RADIUS] - np.log(self.radius)]
        )


@dataclass(frozen=True, eq=False)
class Reduced:
    """What stands for the exact model where its error is small.

    Attributes
    ----------
    interaction
        What spots do to each other on the sheet.
    certificate
        How far the table and that are from the exact model.
    rim
        Of the sheet.
    """

    interaction: Interaction
    certificate: Certificate
    rim: Rim

    @classmethod
    def making(
        cls, response: spot.Response, certificate: Certificate, prior: SpotPrior
    ) -> Generator[None, None, Self]:
        """For a sheet, a piece between two yields."""
        interaction = yield from Interaction.making(response)
        yield
        return cls(interaction, certificate, Rim.of(response, prior))

    def lacking(self, spots: FloatArray, sizes: FloatArray) -> tuple[float, FloatArray]:
        """What the table lacks of spots (k, 4) alone, see :meth:`Certificate.error`; and (n_meas,)
        V that they do to each other, see :meth:`Interaction.change`."""
        if self._native is None:
            alone = self.certificate.error(self.rim.like(spots), sizes)
            return alone, self.interaction.change(spots)
        alone, transfer = self._native.lacking(spots, sizes)
        return alone, self.interaction.state.model.voltages(transfer)

    @cached_property
    def _native(self) -> Any:
        """The same in the native engine; None where that does not run."""
        core = self.interaction.state.model.engine.core
        return core and core.Reduced(
            profile=self.interaction.profile,
            interaction=self.interaction,
            certificate=self.certificate,
            rim=self.rim.tree.data,
            radius=self.rim.radius,
            neighbours=_NEIGHBOURS,
        )


def trial_spots(
    response: spot.Response, prior: SpotPrior, sign: str
) -> tuple[FloatArray, IntArray]:
    """(n, 4) spots at random on which a certificate rests, and (m, 2) numbers of pairs of them."""
    random = np.random.default_rng(_SEED)
    spots = drawn_spots(random, response, prior, sign, _SPOTS)
    return spots, _pairs(random, spots, _APART * prior.radius)


def drawn_spots(
    random: np.random.Generator, response: spot.Response, prior: SpotPrior, sign: str, count: int
) -> FloatArray:
    """(count, 4) spots all over the sheet, as large as the prior has them."""
    centroids = response.spots.mesh.centroids
    spots = np.empty((count, spot.N_PARAMETERS))
    spots[:, :2] = centroids[random.integers(len(centroids), size=count)]
    deviations = random.standard_normal(count).clip(-2.0, 2.0)
    log_radius = np.log(prior.radius) + prior.spread * deviations
    depth = random.uniform(*_DEPTHS, count)
    if sign != "increase":
        depth *= -1.0 if sign == "decrease" else random.choice([-1.0, 1.0], count)
    spots[:, spot.LOG_RADIUS] = log_radius
    spots[:, spot.CONTENT] = FILLING * np.exp(2 * log_radius) * depth
    return spots


def _pairs(random: np.random.Generator, spots: FloatArray, apart: float) -> IntArray:
    """(m, 2) numbers of spots that are so far apart, m."""
    pairs = random.integers(len(spots), size=(4 * _PAIRS, 2))
    away = np.linalg.norm(spots[pairs[:, 0], :2] - spots[pairs[:, 1], :2], axis=1)
    return np.asarray(pairs[away > apart][:_PAIRS])


def _norms(rows: FloatArray) -> FloatArray:
    return np.asarray(np.linalg.norm(rows, axis=1))
