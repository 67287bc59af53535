"""Segmented imaging: where the sheet conducts less, and where more, with sharp edges.

A level set of a smooth random field: where the field is below −1 the medium conducts far less,
above +1 far more, between them as the background (two interfaces of one field, as in the
thresholded fields of Iglesias, Lu & Stuart 2016). The field is found by Gauss–Newton through the
complete forward model; its edges are soft at first, so that distant cells feel them, then sharper.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.special import expit

from tomoskin.core import FloatArray, ModelError
from tomoskin.forward import ForwardModel
from tomoskin.inverse.iterative.absolute import Absolute, Quadratic, medium
from tomoskin.inverse.iterative.field import RandomField
from tomoskin.inverse.iterative.newton import Goal, descend
from tomoskin.inverse.iterative.observation import Observation
from tomoskin.inverse.iterative.unknowns import BACKGROUND_SPREAD, Contacts, Joint, others
from tomoskin.inverse.priors.penalty import Diagonal

BACKGROUND, LESS, MORE = 0, 1, 2
"""Labels."""

SOFTNESS = (0.6, 0.4, 0.3, 0.2, 0.2, 0.15, 0.15, 0.1, 0.1, 0.1)
"""Width of the edges in the field's unit, step by step."""

CONTRAST = 100.0
"""Ratio of the conductivities that counts as far less or far more: beyond it voltages hardly
change."""

_MOST_POINTS = 8192
"""Points that are labelled at a time."""


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
    found
        Conductivity per cell, background, contacts and how they were found.
    field, latent
        The random field, and its numbers (k,).
    """

    found: Absolute
    field: RandomField
    latent: FloatArray

    @property
    def cells(self) -> NDArray[np.uint8]:
        """(n_cells,) BACKGROUND, LESS or MORE."""
        return _labels(self.field.basis @ self.latent)

    def at(self, points: FloatArray) -> NDArray[np.uint8]:
        """(n,) labels at ``points`` (n, d) m of the medium, finer than the cells."""
        labels = np.empty(len(points), np.uint8)
        for start in range(0, len(points), _MOST_POINTS):
            part = slice(start, start + _MOST_POINTS)
            labels[part] = _labels(self.field.at(points[part]) @ self.latent)
        return labels


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
        if not (np.isfinite(drift) and drift > 0):
            raise ModelError(f"expected a drift above 0, got {drift}")
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
        seen = observation.whitened(self.model.pattern.n_meas)
        phases = [Phases(self.field, softness, self.most) for softness in self.softness]
        unknowns, descent = medium(self.model, seen, phases[0], self.contacts, background)
        rest = others(unknowns.n_contacts, self.drift)
        cost = Quadratic(Joint(Diagonal(np.ones(self.field.size)), 1.0, rest))
        for phase in phases:
            unknowns = replace(unknowns, image=phase)
            goal = Goal(unknowns, cost, seen.target)
            descent = descend(goal, descent, most=1, tolerance=0.0)
        point = unknowns.at(descent.unknowns)
        return Segmented(Absolute.of(point, descent), self.field, point.latent)
