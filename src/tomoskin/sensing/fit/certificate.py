"""How far a table, and the interaction of spots, are from the exact model: seen at spots at random.

What is said holds for 19 of 20 spots and pairs.
"""

from __future__ import annotations

from collections.abc import Generator
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, Self

import numpy as np
from scipy.spatial import cKDTree

from tomoskin.core import Arrays, FloatArray, IntArray, finished, reach
from tomoskin.sensing.fit.interaction import Interaction
from tomoskin.sensing.fit.prior import SpotPrior
from tomoskin.sensing.fit.spot import CONTENT, FILLING, LOG_RADIUS, N_PARAMETERS, PROFILE, Response
from tomoskin.sensing.fit.table import ResponseTable

_SPOTS, _PAIRS = 240, 60
_SEED = 27

_DEPTHS = 0.05, 1.0
"""Of the spots, least and most, whatever their sign."""

_MOVED = 40
"""Spots that tell of an uneven sheet's table."""

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
    def of(cls, response: Response, table: ResponseTable, prior: SpotPrior) -> Self:
        """By solving the exact model for some spots, alone and in pairs."""
        random = np.random.default_rng(_SEED)
        spots = drawn_spots(random, response, prior, table.sign, _SPOTS)
        alone = _exact(response, spots[:, None])
        parts = _norms(alone - table.expanded(spots)[:, 0] @ table.basis) / _norms(alone)
        pairs = _pairs(random, spots, _APART * prior.radius)
        beyond = _exact(response, spots[pairs]) - alone[pairs].sum(axis=1)
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
        self, response: Response, table: ResponseTable
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
    """Where a sheet ends: points (n, 2) m in a ``tree``; ``radius``: a spot's median one, m."""

    tree: cKDTree
    radius: float

    @classmethod
    def of(cls, response: Response, prior: SpotPrior) -> Self:
        """Corners and middles of the facets at the rim."""
        mesh = response.spots.mesh
        ends = mesh.points[mesh.boundary]
        points = np.concatenate([ends.reshape(-1, 2), ends.mean(axis=1)])
        return cls(cKDTree(points), prior.radius)

    def like(self, spots: FloatArray) -> FloatArray:
        """(k, 2) see :attr:`Certificate.like`, of spots (k, 4)."""
        away, _ = self.tree.query(spots[:, :2])
        return np.column_stack([away / self.radius, spots[:, LOG_RADIUS] - np.log(self.radius)])


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
        cls, response: Response, certificate: Certificate, prior: SpotPrior
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
            profile=PROFILE,
            interaction=self.interaction,
            certificate=self.certificate,
            rim=self.rim.tree.data,
            radius=self.rim.radius,
            neighbours=_NEIGHBOURS,
        )


def drawn_spots(
    random: np.random.Generator, response: Response, prior: SpotPrior, sign: str, count: int
) -> FloatArray:
    """(count, 4) spots all over the sheet, as large as the prior has them."""
    centroids = response.spots.mesh.centroids
    spots = np.empty((count, N_PARAMETERS))
    spots[:, :2] = centroids[random.integers(len(centroids), size=count)]
    deviations = random.standard_normal(count).clip(-2.0, 2.0)
    log_radius = np.log(prior.radius) + prior.spread * deviations
    depth = random.uniform(*_DEPTHS, count)
    if sign != "increase":
        depth *= -1.0 if sign == "decrease" else random.choice([-1.0, 1.0], count)
    spots[:, LOG_RADIUS] = log_radius
    spots[:, CONTENT] = FILLING * np.exp(2 * log_radius) * depth
    return spots


def _pairs(random: np.random.Generator, spots: FloatArray, apart: float) -> IntArray:
    """(m, 2) numbers of spots that are so far apart, m."""
    pairs = random.integers(len(spots), size=(4 * _PAIRS, 2))
    away = np.linalg.norm(spots[pairs[:, 0], :2] - spots[pairs[:, 1], :2], axis=1)
    return np.asarray(pairs[away > apart][:_PAIRS])


def _exact(response: Response, sets: FloatArray) -> FloatArray:
    """(n, n_meas) V by sets of spots (n, k, 4)."""
    changes = []
    for spots in sets:
        reach()
        changes.append(response.changes([spots])[0])
    return np.array(changes)


def _norms(rows: FloatArray) -> FloatArray:
    return np.asarray(np.linalg.norm(rows, axis=1))
