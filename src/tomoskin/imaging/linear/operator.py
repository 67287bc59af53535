"""A linear operator: difference data in, image out, one product per frame."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from functools import cached_property, partial
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import LinAlgError, cho_factor, cho_solve

from tomoskin.core import DataError, DeferredImage, Image
from tomoskin.model.forward import ForwardModel
from tomoskin.model.pattern import Pattern

MOST_EXCLUDED = 0.25
"""Above this fraction of excluded measurements a frame gives no image: mostly prior."""


class Operator:
    """Difference data of one pattern → image on one mesh. Made once; it does not change.

    Parameters
    ----------
    model
        The model that it was made for: its mesh is the image's, its pattern the data's.
    matrix
        (n_cells, n_meas): S per V, or S per unit of normalised difference.
    precision
        (n_meas, n_meas) P, Hermitian: the inverse of the covariance, up to a factor, that image
        and noise together give the data. An operator is its data's covariance with the image
        times P; by P measurements are excluded from it.
    reference
        (n_meas,) V: the model's voltages where it was linearised.
    difference
        The data's kind, "plain" or "normalised".
    left_out
        (n_meas,) bool: excluded measurements; their columns of ``matrix`` are zero. Without it,
        every one counts.

    Attributes
    ----------
    unit
        Of the image: "S" on a sheet, "S/m" in a volume.
    """

    def __init__(
        self,
        model: ForwardModel,
        matrix: NDArray[Any],
        *,
        precision: NDArray[Any],
        reference: NDArray[Any],
        difference: str,
        left_out: NDArray[np.bool_] | None = None,
    ) -> None:
        self.model = model
        self.matrix = matrix
        self.precision = precision
        self.reference = reference
        self.difference = difference
        self.left_out = np.zeros(len(reference), bool) if left_out is None else left_out
        self.unit = "S" if model.mesh.dimension == 2 else "S/m"

    @cached_property
    def identity(self) -> str:
        """Short hash of mesh, pattern, kind of difference and matrix."""
        digest = hashlib.sha256()
        parts = (self.model.mesh.identity, self.model.pattern.identity, self.difference)
        digest.update(" ".join(parts).encode())
        digest.update(np.ascontiguousarray(self.matrix).tobytes())
        return digest.hexdigest()[:16]

    def __call__(self, dv: NDArray[Any]) -> Image:
        """Image of the difference data ``dv``, (n_meas,), real or complex.

        Of (n, n_meas) all images at once: its values are (n, n_cells).

        Raises
        ------
        DataError
            When there are more or fewer values than rows, or one that counts is not finite.
        """
        return Image((self.matrix @ self.check(dv).T).T, self.unit, self.model.mesh.identity)

    def deferred(self, dv: NDArray[Any]) -> Image:
        """The image, checked at once and computed when it is asked for, for the frame flow.

        In single precision: the product reads all of the matrix once, so that half the bytes
        take half the time.
        """
        checked = self.check(dv)
        make = partial(self._quick_values, checked)
        return DeferredImage(make, self.unit, self.model.mesh.identity)

    def _quick_values(self, checked: NDArray[Any]) -> NDArray[Any]:
        single = checked.astype(np.complex64 if np.iscomplexobj(checked) else np.float32)
        values = self._single @ single
        return np.asarray(values.astype(np.result_type(values, np.float64)))

    def check(self, dv: NDArray[Any]) -> NDArray[Any]:
        """``dv`` with zeros in excluded rows; see :meth:`__call__` for what is refused."""
        n = self.matrix.shape[1]
        if dv.ndim not in (1, 2) or dv.shape[-1] != n:
            raise DataError(f"expected difference data of shape ({n},), got {dv.shape}")
        counted = np.where(self.left_out, 0.0, dv) if self.left_out.any() else dv
        finite = np.isfinite(counted)
        if not finite.all():
            bad = np.unique(np.nonzero(~finite)[-1]).tolist()
            raise DataError(f"expected finite difference data, but rows {bad} are not finite")
        return counted

    def accept(self, pattern: Pattern) -> None:
        """Refuse data of another pattern, however many rows it has.

        Raises
        ------
        DataError
            When ``pattern`` is not the one that the operator was made for.
        """
        own = self.model.pattern
        if pattern.identity != own.identity:
            raise DataError(
                f"expected data of pattern {own.identity} ({own.n_meas} rows on "
                f"{own.n_electrodes} electrodes), got {pattern.identity} ({pattern.n_meas} rows "
                f"on {pattern.n_electrodes})",
                hint="reorder the recording's rows to the operator's pattern",
            )

    def without(self, rows: Sequence[int] | NDArray[Any]) -> Operator:
        """The operator that would have been made without ``rows``, which are then excluded.

        A low-rank downdate, exact. Data keep their shape; what stands in those rows is ignored.

        Raises
        ------
        DataError
            When a row does not exist, or too few remain.
        """
        lost = np.zeros(len(self.left_out), bool)
        index = np.asarray(rows, dtype=np.int64)
        outside = (index < 0) | (index >= len(lost))
        if outside.any():
            raise DataError(f"expected rows from 0 to {len(lost) - 1}, got {index[outside][0]}")
        lost[index] = True
        lost &= ~self.left_out
        if not lost.any():
            return self
        left_out = self.left_out | lost
        if left_out.all():
            raise DataError("expected at least one row that is not left out, got none")
        replaced = self._solved(lost, self.precision[lost])
        matrix = self.matrix - self.matrix[:, lost] @ replaced
        precision = self.precision - self.precision[:, lost] @ replaced
        matrix[:, left_out] = precision[left_out] = precision[:, left_out] = 0.0
        return self.remade(matrix, precision, left_out)

    def _solved(self, missing: NDArray[np.bool_], rhs: NDArray[Any]) -> NDArray[Any]:
        """The precision's block of ``missing`` rows, inverted, times ``rhs``."""
        block = self.precision[np.ix_(missing, missing)]
        try:
            return np.asarray(cho_solve(cho_factor(block, check_finite=False), rhs))
        except LinAlgError as error:
            raise DataError(
                f"too few rows remain without rows {np.flatnonzero(missing).tolist()}",
            ) from error

    def remade(
        self,
        matrix: NDArray[Any],
        precision: NDArray[Any],
        left_out: NDArray[np.bool_] | None = None,
    ) -> Operator:
        """An operator for the same data with another matrix and precision."""
        return Operator(
            self.model,
            matrix,
            precision=precision,
            reference=self.reference,
            difference=self.difference,
            left_out=left_out,
        )

    def filled(self, dv: NDArray[Any], missing: NDArray[np.bool_]) -> NDArray[Any]:
        """``dv`` with its ``missing`` rows, (n_meas,) bool, set as if they were excluded.

        Its image is the one of the operator :meth:`without` these rows: for rows that are
        missing in a frame or two, where a new operator would not pay.
        """
        missing = missing & ~self.left_out
        if not missing.any():
            return dv
        kept, filled = ~(missing | self.left_out), dv.copy()
        across = self.precision[np.ix_(missing, kept)]
        filled[missing] = -self._solved(missing, across @ dv[kept])
        return filled

    @cached_property
    def _single(self) -> NDArray[Any]:
        single = np.complex64 if np.iscomplexobj(self.matrix) else np.float32
        return self.matrix.astype(single, order="F")  # read by columns, which is fastest
