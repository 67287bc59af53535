"""What was measured and how well, in the form that iterations want: few values of unit noise."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tomoskin.core import DataError, FloatArray, numeric

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
        if not (deviation > 0).all():
            row = int(np.argmin(deviation > 0))
            raise DataError(f"expected noise above 0, got {deviation[row]}", where=f"row {row}")
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
    left, size, right = np.linalg.svd(rows, full_matrices=False)
    rank = int(np.count_nonzero(size > _NOTHING * size[0]))
    return Whitened(left[:, :rank].T @ target, size[:rank, None] * right[:rank])
