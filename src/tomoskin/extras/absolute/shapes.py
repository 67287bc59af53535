"""Segmented imaging: where the sheet conducts less, and where more, with sharp edges.

A level set of a smooth random field: where the field is below −1 the medium conducts far less,
above +1 far more, between them as the background (two interfaces of one field, as in the
thresholded fields of Iglesias, Lu & Stuart 2016). The field is found by Gauss–Newton through the
complete forward model; its edges are soft at first, so that distant cells feel them, then sharper.
At the end, the normal law that touches the field's posterior says how probable each label is.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Self

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solve_triangular
from scipy.spatial.distance import cdist
from scipy.special import expit, ndtr

from tomoskin.core import FloatArray, ModelError, check_positive
from tomoskin.extras.absolute.absolute import Absolute, medium
from tomoskin.extras.absolute.newton import Goal, descend
from tomoskin.extras.absolute.unknowns import (
    BACKGROUND_SPREAD,
    Contacts,
    Joint,
    ModelPoint,
    Observation,
    others,
)
from tomoskin.model.forward import ForwardModel
from tomoskin.model.mesh import Mesh
from tomoskin.model.prior import Diagonal, matern_correlation, pivoted_cholesky

LEFT_OUT = 0.02
"""Part of the field's variance that the modes may lack, at the worst point."""


@dataclass(frozen=True, eq=False)
class RandomField:
    """A Matérn field of unit variance on a mesh: image = basis @ independent normal numbers.

    The basis is the pivoted Cholesky factor of the covariance (Harbrecht, Peters & Schneider
    2012): it has a column for each of the few places that leave no more than a part of
    the variance unexplained anywhere.

    Attributes
    ----------
    basis
        (n_cells, k).
    places
        (k, d) m, in the order in which they were taken.
    factor
        (k, k) lower triangular: the basis at those places.
    correlation, scale
        The covariance of two places: ``correlation(scale · distance)``.
    mean
        (k,) what is taken off the basis everywhere.
    """

    basis: FloatArray
    places: FloatArray
    factor: FloatArray
    correlation: Callable[[FloatArray], FloatArray]
    scale: float
    mean: FloatArray

    @classmethod
    def on(
        cls, mesh: Mesh, length: float, smoothness: float = 2.5, left_out: float = LEFT_OUT
    ) -> Self:
        """Field that is correlated over ``length`` m.

        Raises
        ------
        ModelError
            For a length that is not positive, or a smoothness that is not 0.5, 1.5 or 2.5.
        """
        correlation, scale = matern_correlation(length, smoothness)

        def column(cell: int) -> FloatArray:
            gap = cdist(mesh.centroids, mesh.centroids[cell][None])[:, 0]
            return correlation(scale * gap)

        n = len(mesh.cells)
        basis, pivots = pivoted_cholesky(column, np.ones(n), left_out, n)
        places, none = mesh.centroids[pivots], np.zeros(len(pivots))
        return cls(basis, places, basis[pivots], correlation, scale, none)

    def centred(self, mesh: Mesh, cells: NDArray[np.bool_] | None = None) -> Self:
        """The field less its mean over ``cells`` of ``mesh``, for images on a background.

        Without ``cells``, over all of them.
        """
        area = mesh.volumes if cells is None else mesh.volumes * cells
        mean = area @ self.basis / area.sum()
        return replace(self, basis=self.basis - mean, mean=self.mean + mean)

    @property
    def size(self) -> int:
        """The number of modes that the field is made of."""
        return int(self.basis.shape[1])

    def at(self, points: FloatArray) -> FloatArray:
        """(n, k) basis at ``points`` (n, d) m: the same image between the cells' centres."""
        covariance = self.correlation(self.scale * cdist(points, self.places))
        return np.asarray(solve_triangular(self.factor, covariance.T, lower=True).T - self.mean)


BACKGROUND, LESS, MORE = 0, 1, 2
"""Labels."""

SOFTNESS = (0.6, 0.4, 0.3, 0.2, 0.2, 0.15, 0.15, 0.1, 0.1, 0.1)
"""Width of the edges in the field's unit, step by step."""

CENTRED = (0.4, 0.7)
"""Parts of the steps after which the field's mean is that over the background found so far."""

CONTRAST = 100.0
"""Ratio of the conductivities that counts as far less or far more: beyond it voltages hardly
change."""

_MOST_POINTS = 8192
"""Points that are labelled at a time."""

_LEAST_VARIANCE = 1e-12
"""Of the field at a point: rounding may leave less."""


@dataclass(frozen=True, eq=False)
class Phases:
    """Latent numbers → contrast, with edges of a given softness.

    The reflection coefficient (σ − σ₀)/(σ + σ₀), which a voltage is about linear in, goes from
    −``most`` to 0 to +``most`` as the field crosses −1 and +1.
    """

    field: RandomField
    softness: float
    most: float

    @property
    def size(self) -> int:
        """Number of the field's modes."""
        return self.field.size

    def contrast(self, latent: FloatArray) -> FloatArray:
        """(n_cells,) log of conductivity over background."""
        more, less = self._sides(latent)
        return np.asarray(2.0 * np.arctanh(self.most * (more - less)))

    def chain(self, latent: FloatArray, jacobian: FloatArray) -> FloatArray:
        """(m, k) from the derivative by the contrast, (m, n_cells)."""
        more, less = self._sides(latent)
        slope = self.most * (more * (1.0 - more) + less * (1.0 - less)) / self.softness
        by_field = 2.0 * slope / (1.0 - (self.most * (more - less)) ** 2)
        return np.asarray((jacobian * by_field) @ self.field.basis)

    def _sides(self, latent: FloatArray) -> tuple[FloatArray, FloatArray]:
        level = self.field.basis @ latent
        return expit((level - 1.0) / self.softness), expit((-level - 1.0) / self.softness)


@dataclass(frozen=True, eq=False)
class Segmented:
    """Regions, and the conductivity that explains what was measured.

    Attributes
    ----------
    absolute
        Conductivity per cell, background, contacts and how they were found.
    field, latent
        The random field, and its numbers (k,).
    covariance
        (k, k) of these numbers given the data: of the normal law that touches their posterior
        where the edges are softest, since sharp ones hide what a new region would change.
    """

    absolute: Absolute
    field: RandomField
    latent: FloatArray
    covariance: FloatArray

    @property
    def cells(self) -> NDArray[np.uint8]:
        """(n_cells,) BACKGROUND, LESS or MORE."""
        return _labels(self.field.basis @ self.latent)

    def at(self, points: FloatArray) -> NDArray[np.uint8]:
        """(n,) labels at ``points`` (n, d) m of the medium, finer than the cells."""
        return np.concatenate([_labels(basis @ self.latent) for basis in self._bases(points)])

    def probability(self, points: FloatArray) -> FloatArray:
        """(n, 3) of BACKGROUND, LESS and MORE at ``points`` (n, d) m, given the data."""
        return np.concatenate([self._probability(basis) for basis in self._bases(points)])

    def entropy(self, points: FloatArray) -> FloatArray:
        """(n,) bits at ``points`` (n, d) m: 0 where the data tell the label, at most log₂ 3."""
        p = self.probability(points)
        return np.asarray(-(p * np.log2(np.where(p > 0, p, 1.0))).sum(axis=1))

    def _probability(self, basis: FloatArray) -> FloatArray:
        mean = basis @ self.latent
        variance = ((basis @ self.covariance) * basis).sum(axis=1)
        deviation = np.sqrt(np.maximum(variance, _LEAST_VARIANCE))
        less, more = ndtr((-1.0 - mean) / deviation), ndtr((mean - 1.0) / deviation)
        return np.stack([np.maximum(1.0 - less - more, 0.0), less, more], axis=1)

    def _bases(self, points: FloatArray) -> Iterator[FloatArray]:
        """The field's basis at ``points``, some at a time."""
        for start in range(0, max(len(points), 1), _MOST_POINTS):
            yield self.field.at(points[start : start + _MOST_POINTS])


def _labels(level: FloatArray) -> NDArray[np.uint8]:
    return np.where(level > 1.0, MORE, np.where(level < -1.0, LESS, BACKGROUND)).astype(np.uint8)


class ShapeImaging:
    """Finds regions that conduct far less or far more than the medium around them.

    Parameters
    ----------
    model
        The forward model; its contact impedances are known, or the start.
    length
        Correlation length of the field, m: about half the width of what is looked for.
    contacts
        "fixed", "one" common factor or one for "each" electrode.
    contrast
        Ratio of the conductivities of regions and medium.
    drift
        Deviation expected of the logarithm of the medium's conductivity.
    softness
        Width of the edges in the field's unit, one Gauss–Newton step each.

    Raises
    ------
    ModelError
        For a length, contrast or softness that is impossible.
    """

    def __init__(
        self,
        model: ForwardModel,
        length: float,
        *,
        contacts: Contacts = "fixed",
        contrast: float = CONTRAST,
        drift: float = BACKGROUND_SPREAD,
        softness: Sequence[float] = SOFTNESS,
    ) -> None:
        if not (np.isfinite(contrast) and contrast > 1):
            raise ModelError(f"expected a contrast above 1, got {contrast}")
        check_positive(drift, "a drift")
        if not (len(softness) and np.isfinite(softness).all() and min(softness) > 0):
            raise ModelError(f"expected softness above 0, step by step, got {list(softness)}")
        self.model = model
        # a uniform change is the background's to explain
        self.field = RandomField.on(model.mesh, length).centred(model.mesh)
        self.contacts = contacts
        self.most = (contrast - 1.0) / (contrast + 1.0)
        self.drift = drift
        self.softness = tuple(softness)

    def __call__(self, observation: Observation, background: float | None = None) -> Segmented:
        """Regions that explain ``observation``.

        ``background`` is what the medium is expected to have, S or S/m; without it, the uniform
        one that explains most is the beginning. Raises DataError when the observation is not one
        of this pattern.
        """
        data = observation.whitened(self.model.pattern.n_meas)
        field, last = self.field, len(self.softness)
        softest = Phases(field, self.softness[0], self.most)
        unknowns, descent = medium(self.model, data, softest, self.contacts, background)
        rest = others(unknowns.n_contacts, self.drift)
        joint = Joint(Diagonal(np.ones(field.size)), 1.0, rest)
        again = {round(part * last) for part in CENTRED}
        for step, softness in enumerate(self.softness):
            if step in again:
                field = self._centred(field, descent.unknowns[: field.size])
            unknowns = replace(unknowns, image=Phases(field, softness, self.most))
            goal = Goal(unknowns.at, data.target, lambda _: joint)
            descent = descend(goal, descent, most=1, tolerance=0.0)
        point = unknowns.at(descent.unknowns)
        softest = replace(softest, field=field)
        covariance = _covariance(point, softest, rest)
        return Segmented(Absolute.of(point, descent), field, point.latent, covariance)

    def _centred(self, field: RandomField, latent: FloatArray) -> RandomField:
        """Its mean is that of the background: large regions of a kind would lift all the rest."""
        background = np.abs(field.basis @ latent) < 1.0
        return field.centred(self.model.mesh, background) if background.any() else field


def _covariance(point: ModelPoint, softest: Phases, rest: Diagonal) -> FloatArray:
    """(k, k) of the latent image at ``point``, whatever background and contacts are."""
    jacobian, k = point.jacobian, softest.size
    jacobian[:, :k] = softest.chain(point.latent, point.by_contrast)
    precision = jacobian.T @ jacobian
    precision[np.diag_indices_from(precision)] += np.append(np.ones(k), rest.matrix)
    return np.asarray(np.linalg.inv(precision)[:k, :k])
