"""Regions placed in the medium, how likely they are, and the likeliest near by."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from tomoskin.core import FloatArray
from tomoskin.forward import ForwardModel
from tomoskin.inverse.iterative.newton import Descent, Goal, descend
from tomoskin.inverse.iterative.observation import Whitened
from tomoskin.inverse.iterative.unknowns import ModelPoint, Unknowns
from tomoskin.inverse.posterior.packing import Covers, Packing
from tomoskin.inverse.posterior.stars import N_PARAMETERS, StarPrior
from tomoskin.inverse.priors.penalty import Diagonal, Penalty

_REACH = 2.0
"""Deviations by which a parameter may change in one step."""

_TOLERANCE = 0.01
"""A step that gains less than this part of the objective is the last."""


@dataclass(frozen=True, eq=False)
class PlacedRegions:
    """What regions are compared by: data, forward model and what was expected.

    Attributes
    ----------
    model
        The forward model.
    data
        Values of unit noise.
    prior
        Of each region.
    most
        Reflection coefficient of a region.
    background
        S, what the medium is expected to have.
    drift
        Deviation of its logarithm.
    expected
        Number of regions, the mean of a Poisson law.
    """

    model: ForwardModel
    data: Whitened
    prior: StarPrior
    most: float
    background: float
    drift: float
    expected: float

    @cached_property
    def covers(self) -> Covers:
        """Which cells regions cover."""
        return Covers(self.prior, self.model.mesh)

    def place(self, kinds: tuple[int, ...], unknowns: FloatArray) -> Placement:
        """Regions of ``kinds`` with the latent numbers and log background (n·9 + 1,)."""
        return Placement(self, kinds, unknowns)

    def misfit(self, conductivity: FloatArray) -> float:
        """Square sum of what a conductivity (n_cells,) S leaves unexplained, of unit noise."""
        predicted = self.data.rows @ self.model.at(conductivity).voltages
        return float(((self.data.target - predicted) ** 2).sum())

    def fitted(self, begin: Placement, most: int) -> Placement:
        """The likeliest near ``begin``, by at most so many Gauss–Newton steps."""
        unknowns, cost = begin.parts
        force = cost.normal.matrix * begin.unknowns
        start = Descent(begin.unknowns, force, (), "not begun", False)
        goal = Goal(unknowns, cost, self.data.target)
        found = descend(goal, start, most=most, tolerance=_TOLERANCE, reach=_REACH)
        return self.place(begin.kinds, found.unknowns)


@dataclass(frozen=True, eq=False)
class Placement:
    """Regions placed in the medium.

    Attributes
    ----------
    among
        What they are compared by.
    kinds
        LESS or MORE, of each region.
    unknowns
        (n·9 + 1,): latent numbers of each region, and the logarithm of the background over what
        was expected.
    """

    among: PlacedRegions
    kinds: tuple[int, ...]
    unknowns: FloatArray

    @property
    def stars(self) -> FloatArray:
        """(n, 9) latent numbers."""
        return self.unknowns[:-1].reshape(-1, N_PARAMETERS)

    @property
    def parts(self) -> tuple[Unknowns, _Cost]:
        """The forward problem and the cost of its unknowns."""
        of = self.among
        packing = Packing(of.covers, self.kinds, of.most)
        normal = Diagonal(np.append(np.ones(packing.size), 1.0 / of.drift**2))
        unknowns = Unknowns(of.model, packing, of.background, "fixed", of.data.rows)
        return unknowns, _Cost(packing, normal)

    @cached_property
    def point(self) -> ModelPoint:
        """The forward problem here."""
        return self.parts[0].at(self.unknowns)

    @cached_property
    def misfit(self) -> float:
        """Square sum of what they leave unexplained, of unit noise."""
        residual = self.among.data.target - self.point.predicted
        return float(residual @ residual)

    @cached_property
    def objective(self) -> float:
        """Minus twice the logarithm of the posterior density, but for a constant of the data."""
        _, cost = self.parts
        return self.misfit + cost.energy(self.unknowns, cost.normal.matrix * self.unknowns)

    @cached_property
    def precision(self) -> FloatArray:
        """(n·9 + 1, n·9 + 1) of the normal law that touches the posterior here."""
        jacobian = self.point.jacobian
        return np.asarray(jacobian.T @ jacobian + np.diag(self.parts[1].normal.matrix))

    @cached_property
    def evidence(self) -> float:
        """Logarithm of the probability of as many regions of these kinds, by Laplace's integral.

        But for a constant of the data (MacKay 2003, chapter 27); for placements that are fitted.
        """
        n = len(self.kinds)
        spread = 2.0 * np.log(self.among.drift) + np.linalg.slogdet(self.precision)[1]
        return float(n * np.log(self.among.expected / 2.0) - 0.5 * (self.objective + spread))

    def with_noise(self, factor: float) -> Placement:
        """The same regions, judged by data of so many times the noise."""
        data, of = self.among.data, self.among
        scaled = replace(data, target=data.target / factor, rows=data.rows / factor)
        return replace(of, data=scaled).place(self.kinds, self.unknowns)

    def without(self, i: int) -> Placement:
        """The same but for region ``i``."""
        kinds = self.kinds[:i] + self.kinds[i + 1 :]
        stars = np.delete(self.stars, i, axis=0)
        return self.among.place(kinds, np.append(stars, self.unknowns[-1]))

    def with_star(self, kind: int, star: FloatArray) -> Placement:
        """The same and one region more."""
        unknowns = np.concatenate([self.unknowns[:-1], star, self.unknowns[-1:]])
        return self.among.place((*self.kinds, kind), unknowns)


@dataclass(frozen=True, eq=False)
class _Cost:
    """Minus twice the logarithm of the prior's density: normal, and regions that keep apart."""

    packing: Packing
    normal: Diagonal

    def penalty(self, unknowns: FloatArray, jacobian: FloatArray) -> Penalty:
        """The normal part."""
        del unknowns, jacobian
        return self.normal

    def energy(self, unknowns: FloatArray, force: FloatArray) -> float:
        """Both parts."""
        return float(unknowns @ force) + self.packing.crowding(unknowns[:-1])
