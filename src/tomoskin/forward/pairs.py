"""Small steps from a basis of fields to pairs of electrodes."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from tomoskin.core import IntArray


def centred(grounded: NDArray[Any]) -> NDArray[Any]:
    """Transfer resistance against the ground electrode → rows and columns that sum to zero."""
    full = padded(grounded)
    rows = full - full.mean(axis=-2, keepdims=True)
    return np.asarray(rows - rows.mean(axis=-1, keepdims=True))


def padded(grounded: NDArray[Any]) -> NDArray[Any]:
    """Transfer resistance against the ground electrode, with its row and column of zeros.

    Voltages are taken from this one: the means that centring subtracts would carry the digits
    lost to one bad contact into all electrodes.
    """
    n = grounded.shape[-1] + 1
    full = np.zeros((*grounded.shape[:-2], n, n), dtype=grounded.dtype)
    full[..., :-1, :-1] = grounded
    return full


def pair_differences(fields: NDArray[Any], pairs: IntArray) -> NDArray[Any]:
    """(n_electrodes, …) fields → (n_pairs, …): first electrode of each pair minus the second."""
    return np.asarray(fields[pairs[:, 0]] - fields[pairs[:, 1]])
