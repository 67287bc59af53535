"""The nuisance subspace of the data, projected out exactly: lost rows, floats, drift."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Self

import numpy as np
from scipy.linalg import LinAlgError, cho_factor, cho_solve

from tomoskin.core import DataError, FloatArray

_DEPENDENT = 1e-7
"""Directions with less than this part of the largest follow from the others."""


@dataclass(frozen=True, eq=False)
class NuisanceSubspace:
    """Noise of unbounded variance along ``directions`` N, (n_meas, k).

    Data of covariance P⁻¹ with that noise have P − PN(NᵀPN)⁻¹NᵀP for their inverse covariance
    (the limit of Woodbury's identity; Rasmussen & Williams 2006, equation 2.41 with its vague
    limit, 2.42). An operator is a covariance times it, so data less N(NᵀPN)⁻¹NᵀP·data give the
    image of the operator that was made with that noise. ``weights`` (k, n_meas) is the
    (NᵀPN)⁻¹NᵀP. A lost row is a direction with a single one in it.
    """

    directions: FloatArray
    weights: FloatArray

    @classmethod
    def of(cls, directions: FloatArray, precision: FloatArray) -> Self:
        """For data of inverse covariance ``precision`` P, (n_meas, n_meas), up to a factor.

        Raises
        ------
        DataError
            When too few measurements remain.
        """
        basis = _independent(directions)
        carried = precision @ basis
        try:
            factor = cho_factor(basis.T @ carried, check_finite=False)
        except LinAlgError as error:
            raise DataError(
                f"expected more than {basis.shape[1]} rows after {basis.shape[1]} directions "
                f"are projected out, got {len(basis)}"
            ) from error
        return cls(basis, cho_solve(factor, carried.T, check_finite=False))

    def without_free(self, seen: FloatArray, fitted: FloatArray) -> Self:
        """The same, and without the images in the null space of the operator's prior.

        Such an image, as Laplace's constant, is fitted whatever it costs, and nothing in P tells
        of it: along what it does to the data P is zero, so that it cannot be distinguished from
        noise there.

        Parameters
        ----------
        seen
            (n_meas, k): what the free images do to the data.
        fitted
            (k, n_meas): how large the operator makes each of them.
        """
        weights = fitted - (fitted @ self.directions) @ self.weights
        return type(self)(
            np.hstack([self.directions, seen]), np.concatenate([self.weights, weights])
        )

    @property
    def count(self) -> int:
        """How many directions there are."""
        return int(self.directions.shape[1])

    def __call__(self, dv: FloatArray) -> FloatArray:
        """(n_meas,) ``dv`` with its part along the directions as the rest leads one to expect."""
        return np.asarray(dv - self.directions @ (self.weights @ dv))

    def projected(self, matrix: FloatArray) -> FloatArray:
        """(m, n_meas): what ``matrix`` (m, n_meas) makes of data that have been blinded."""
        return np.asarray(matrix - (matrix @ self.directions) @ self.weights)


def _independent(directions: FloatArray) -> FloatArray:
    """Orthonormal columns that span the same."""
    size = np.linalg.norm(directions, axis=0)
    kept = directions[:, size > 0] / size[size > 0]
    if not kept.shape[1]:
        return np.asarray(kept)
    basis, singular, _ = np.linalg.svd(kept, full_matrices=False)
    return np.asarray(basis[:, singular > _DEPENDENT * singular[0]])
