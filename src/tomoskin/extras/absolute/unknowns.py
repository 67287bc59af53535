"""What was measured and how well, as few values of unit noise; and what an iteration looks for: an
image, the background that it stands on, contact impedances."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any, Literal, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.sparse import csr_array, eye_array

from tomoskin.core import DataError, FloatArray, ModelError, check_positive, numeric, refuse_first
from tomoskin.model.forward import ForwardModel, State
from tomoskin.model.prior import Carried, Diagonal, Penalty

_NOTHING = 1e-9
"""A combination of voltages this far below the strongest one is none."""


@dataclass(frozen=True, eq=False)
class Observation:
    """Measured values, each a combination of the voltages of a pattern, with their noise.

    Attributes
    ----------
    values
        (k,) V.
    noise
        (k,) V, standard deviation of each value; infinite for an excluded one.
    combine
        (k, n_meas): what each value is of the pattern's voltages. Without it, value i is
        voltage i. With it the currents of a drive may be spread over many electrodes, rows may
        stand twice, and known errors of the read-out may enter.
    """

    values: FloatArray
    noise: FloatArray
    combine: FloatArray | None = None

    @classmethod
    def of(
        cls, values: ArrayLike, noise: ArrayLike, combine: NDArray[Any] | None = None
    ) -> Observation:
        """Check and freeze; ``noise`` may be one number.

        Raises
        ------
        DataError
            For what is not real numbers, shapes that do not fit, values that count and are not
            finite, which are named, noise that is not positive, or when nothing counts.
        """
        taken = numeric(values, DataError, where="values", real=True).astype(float)
        if taken.ndim != 1:
            raise DataError(f"expected values of shape (n,), got {taken.shape}")
        deviation = numeric(noise, DataError, where="noise", real=True).astype(float)
        if deviation.shape not in ((), taken.shape):
            raise DataError(f"expected one noise or {len(taken)}, got shape {deviation.shape}")
        deviation = np.broadcast_to(deviation, taken.shape)
        refuse_first(~(deviation > 0), deviation, "noise above 0", "row", DataError)
        counts = np.isfinite(deviation)
        bad = np.flatnonzero(counts & ~np.isfinite(taken)).tolist()
        if bad:
            raise DataError(
                f"expected finite values, but rows {bad} are not finite",
                hint="give an infinite noise to the rows that do not count",
            )
        if not counts.any():
            raise DataError("expected at least one row with finite noise, got none")
        if combine is not None and (combine.ndim != 2 or len(combine) != len(taken)):
            raise DataError(f"expected combine of shape ({len(taken)}, n), got {combine.shape}")
        return cls(taken, deviation, combine)

    def whitened(self, n_meas: int) -> Whitened:
        """Values of unit noise, no more of them than there are different ones.

        Raises
        ------
        DataError
            When it is not made for a pattern of ``n_meas`` rows.
        """
        expected = len(self.values) if self.combine is None else self.combine.shape[1]
        if expected != n_meas:
            raise DataError(f"expected an observation of {n_meas} voltages, got one of {expected}")
        counts = np.isfinite(self.noise)
        scale = 1.0 / self.noise[counts]
        target = self.values[counts] * scale
        if self.combine is None:
            rows = np.zeros((len(target), n_meas))
            rows[np.arange(len(target)), np.flatnonzero(counts)] = scale
            return Whitened(target, rows)
        return _reduced(target, self.combine[counts] * scale[:, None])


@dataclass(frozen=True, eq=False)
class Whitened:
    """Values of independent unit noise.

    Attributes
    ----------
    target
        (m,) values.
    rows
        (m, n_meas): what they are of the pattern's voltages.
    """

    target: FloatArray
    rows: FloatArray


def _reduced(target: FloatArray, rows: FloatArray) -> Whitened:
    """The same sum of squares from as many values as the rows have rank."""
    columns, size, basis = np.linalg.svd(rows, full_matrices=False)
    rank = int(np.count_nonzero(size > _NOTHING * size[0]))
    return Whitened(columns[:, :rank].T @ target, size[:rank, None] * basis[:rank])


Contacts = Literal["fixed", "one", "each"]
"""Which contact impedances are looked for: none, a common factor, a factor per electrode."""

BACKGROUND_SPREAD = 1.0
"""Deviation of the logarithm of the background from its start: a factor of e, hardly a wish."""

CONTACT_SPREAD = 1.0
"""The same of a contact impedance."""


class ImageMap(Protocol):
    """Latent image → logarithm of conductivity over background, cell by cell."""

    @property
    def size(self) -> int:
        """The number of latent values of an image."""

    def contrast(self, latent: FloatArray) -> FloatArray:
        """(n_cells,) log of conductivity over background."""

    def chain(self, latent: FloatArray, jacobian: FloatArray) -> FloatArray:
        """(m, size) derivative by the latent image, from (m, n_cells) by the contrast."""


@dataclass(frozen=True, eq=False)
class LinearMap:
    """The contrast is linear in the latent image: ``basis`` (n_cells, size) times it."""

    basis: csr_array

    @classmethod
    def of_cells(cls, n_cells: int, size: int) -> LinearMap:
        """One latent value a cell, or none: no image."""
        return cls(csr_array(eye_array(n_cells, size)))

    @property
    def size(self) -> int:
        """The number of latent values."""
        return int(self.basis.shape[1])

    def contrast(self, latent: FloatArray) -> FloatArray:
        """(n_cells,) log of conductivity over background."""
        return np.asarray(self.basis @ latent)

    def chain(self, latent: FloatArray, jacobian: FloatArray) -> FloatArray:
        """(m, size) derivative by the latent image."""
        del latent
        return np.asarray(jacobian @ self.basis)


@dataclass(frozen=True, eq=False)
class Unknowns:
    """The vector of unknowns: latent image, log background, log contact impedances.

    The last two count from where they start. Every conductivity and impedance that follows
    from them is positive.

    Attributes
    ----------
    model
        The forward model; its contact impedances are the start.
    image
        How the latent image becomes contrast.
    background
        Start of the background, S or S/m.
    contacts
        Which contact impedances are looked for.
    rows
        (m, n_meas): values of unit noise from voltages.
    """

    model: ForwardModel
    image: ImageMap
    background: float
    contacts: Contacts
    rows: FloatArray

    def __post_init__(self) -> None:
        """Refuse what has no logarithm."""
        check_positive(self.background, "a background")
        if np.iscomplexobj(self.model.contact_impedance):
            raise ModelError("expected real contact impedances, got complex ones")
        if self.contacts not in ("fixed", "one", "each"):
            raise ModelError(f'expected contacts "fixed", "one" or "each", got "{self.contacts}"')

    @property
    def n_contacts(self) -> int:
        """The number of contact factors that are unknown."""
        return {"fixed": 0, "one": 1, "each": self.model.pattern.n_electrodes}[self.contacts]

    @property
    def size(self) -> int:
        """The number of all unknowns: image, background and contacts."""
        return self.image.size + 1 + self.n_contacts

    def at(self, unknowns: FloatArray) -> ModelPoint:
        """The forward problem at ``unknowns`` (size,)."""
        return ModelPoint(self, unknowns)


@dataclass(frozen=True, eq=False)
class ModelPoint:
    """One vector of unknowns, and what follows from it."""

    of: Unknowns
    unknowns: FloatArray

    @property
    def latent(self) -> FloatArray:
        """The part of the unknowns that makes the image."""
        return self.unknowns[: self.of.image.size]

    @property
    def background(self) -> float:
        """Conductivity of the background, S or S/m."""
        return float(self.of.background * np.exp(self.unknowns[self.of.image.size]))

    @property
    def contact_impedance(self) -> FloatArray:
        """Contact impedances (n_electrodes,)."""
        start = self.of.model.contact_impedance
        if not self.of.n_contacts:
            return np.asarray(start)
        return np.asarray(start * np.exp(self.unknowns[self.of.image.size + 1 :]))

    @cached_property
    def conductivity(self) -> FloatArray:
        """The conductivity (n_cells,) in S or S/m."""
        with np.errstate(over="ignore"):  # the model refuses what is not finite
            return self.background * np.exp(self.of.image.contrast(self.latent))

    @cached_property
    def state(self) -> State:
        """The forward model at this point."""
        model = self.of.model
        if self.of.n_contacts:
            impedance = self.contact_impedance
            model = ForwardModel(
                model.mesh, model.pattern, impedance, model.current, order=model.order
            )
        return model.at(self.conductivity)

    @property
    def predicted(self) -> FloatArray:
        """Predicted values (m,) of unit noise."""
        return np.asarray(self.of.rows @ self.state.voltages)

    @property
    def jacobian(self) -> FloatArray:
        """Derivatives (m, size) of the predicted values."""
        rows, by_contrast = self.of.rows, self.by_contrast
        parts = [self.of.image.chain(self.latent, by_contrast), by_contrast.sum(axis=1)[:, None]]
        if self.of.n_contacts:
            by_contact = rows @ (self.state.contact_jacobian * self.contact_impedance)
            parts.append(
                by_contact.sum(axis=1)[:, None] if self.of.contacts == "one" else by_contact
            )
        return np.hstack(parts)

    @property
    def by_contrast(self) -> FloatArray:
        """(m, n_cells) derivative by the logarithm of each cell's conductivity."""
        return np.asarray(self.of.rows @ (self.state.jacobian * self.conductivity))


@dataclass(frozen=True, eq=False)
class Joint:
    """Penalty of image, background and contacts: no two of them know of each other.

    Attributes
    ----------
    image
        Penalty of the latent image.
    strength
        What it counts: α².
    others
        Penalty of all that follows the image.
    """

    image: Penalty
    strength: float
    others: Diagonal

    @property
    def free(self) -> FloatArray:
        """The image's free images; nothing else is free."""
        free = self.image.free
        return np.vstack([free, np.zeros((len(self.others.matrix), free.shape[1]))])

    @property
    def matrix(self) -> FloatArray:
        """The matrix Q of all unknowns, dense."""
        image = self.image.matrix * self.strength
        n = len(image)
        both = np.zeros((n + len(self.others.matrix),) * 2)
        both[:n, :n] = image if image.ndim == 2 else np.diag(image)
        both[n:, n:] = np.diag(self.others.matrix)
        return both

    def carry(self, jacobian: FloatArray) -> Carried:
        """Both parts carry their own columns."""
        n = jacobian.shape[1] - len(self.others.matrix)
        spread, gram = self.image.carry(jacobian[:, :n])
        more, gram_more = self.others.carry(jacobian[:, n:])
        return np.vstack([spread / self.strength, more]), gram / self.strength + gram_more


def others(contacts: int, background_spread: float = BACKGROUND_SPREAD) -> Diagonal:
    """Penalty of the background and of so many contact impedances."""
    spread = np.append(background_spread, np.full(contacts, CONTACT_SPREAD))
    return Diagonal(1.0 / spread**2)
