"""Small steps from a basis of fields to pairs of electrodes."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from tomoskin.core import IntArray


def centred(grounded: NDArray[Any]) -> NDArray[Any]:
    """Transfer resistance against the ground electrode → rows and columns that sum to zero."""
    n = len(grounded) + 1
    full = np.zeros((*grounded.shape[:-2], n, n), dtype=grounded.dtype)
    full[..., :-1, :-1] = grounded
    rows = full - full.mean(axis=-2, keepdims=True)
    return np.asarray(rows - rows.mean(axis=-1, keepdims=True))


def pair_differences(fields: NDArray[Any], pairs: IntArray) -> NDArray[Any]:
    """(n_electrodes, …) fields → (n_pairs, …): first electrode of each pair minus the second."""
    return np.asarray(fields[pairs[:, 0]] - fields[pairs[:, 1]])
