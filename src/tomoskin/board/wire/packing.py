"""Samples of ten bits ↔ bytes: four lower bytes, then one with the four upper halves."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

_GROUP = 4
_SHIFTS = np.array([0, 2, 4, 6], dtype=np.uint8)


def pack(samples: NDArray[np.uint16]) -> NDArray[np.uint8]:
    """(n + ⌈n/4⌉,) uint8 for (n,) samples below 1,024."""
    n = len(samples)
    padded = np.zeros(-(-n // _GROUP) * _GROUP, dtype=np.uint16)
    padded[:n] = samples
    groups = padded.reshape(-1, _GROUP)
    upper = np.bitwise_or.reduce((groups >> 8) << _SHIFTS, axis=1)
    packed = np.column_stack([groups & 0xFF, upper]).astype(np.uint8).ravel()
    return packed if n % _GROUP == 0 else np.append(packed[: n + n // _GROUP], packed[-1])


def unpack(packed: NDArray[np.uint8]) -> NDArray[np.uint16]:
    """(n,) samples; :func:`packed_size_fits` of the length."""
    n_groups = len(packed) // (_GROUP + 1)
    groups = packed[: n_groups * (_GROUP + 1)].reshape(n_groups, _GROUP + 1)
    samples = _join(groups[:, :_GROUP], groups[:, _GROUP:]).ravel()
    rest = packed[n_groups * (_GROUP + 1) :]
    return np.append(samples, _join(rest[:-1], rest[-1:])) if len(rest) else samples


def packed_size_fits(size: int) -> bool:
    """Whether samples can be packed into that many bytes."""
    return size % (_GROUP + 1) != 1


def _join(lower: NDArray[np.uint8], upper: NDArray[np.uint8]) -> NDArray[np.uint16]:
    high = (upper >> _SHIFTS[: lower.shape[-1]] & 3).astype(np.uint16)
    joined: NDArray[np.uint16] = np.left_shift(high, 8, dtype=np.uint16) | lower
    return joined
