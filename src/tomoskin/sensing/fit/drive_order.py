"""Which drives to ask for: a sparse watch over an untouched sheet, or what touches need most."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from tomoskin.core import FloatArray, IntArray


def drive_sizes(
    changes: FloatArray, covariance: FloatArray, drives: IntArray, excluded: NDArray[np.bool_]
) -> FloatArray:
    """(n, n_drive): squared deviations of the noise that each drive has of ``changes``.

    These are (n, n_meas) V. Drives share no noise; what is ``excluded`` (n_meas,) tells nothing.
    """
    sizes = np.zeros((len(changes), int(drives.max()) + 1))
    for drive in range(sizes.shape[1]):
        rows = np.flatnonzero((drives == drive) & ~excluded)
        if len(rows):
            own = changes[:, rows]
            solved = np.linalg.lstsq(covariance[np.ix_(rows, rows)], own.T, rcond=1e-10)[0]
            sizes[:, drive] = np.einsum("nr,rn->n", own, solved)
    return sizes


def watch_order(sizes: FloatArray) -> list[int]:
    """All drives, the first ones such that the touch that is seen worst is seen best.

    ``sizes`` (n, n_drive): squared deviations of the noise that each drive has of each touch. The
    next drive is that which leaves the largest least sum (a greedy cover: Krause & Guestrin 2007,
    for a bounded count); the sum of logarithms decides between equals.
    """
    order: list[int] = []
    total = np.zeros(len(sizes))
    while len(order) < sizes.shape[1]:
        rest = [drive for drive in range(sizes.shape[1]) if drive not in order]
        worth = [_worth(total + sizes[:, drive]) for drive in rest]
        best = rest[max(range(len(rest)), key=worth.__getitem__)]
        order.append(best)
        total = total + sizes[:, best]
    return order


def _worth(sizes: FloatArray) -> tuple[float, float]:
    faint = np.percentile(sizes, 1)  # no single place decides
    return float(faint), float(np.log(sizes + 1e-12).sum())


def drives_needed(sizes: FloatArray, order: Sequence[int], ratio: float) -> int | None:
    """How many drives of an ``order`` show every touch by ``ratio`` deviations; None: not even
    all."""
    least = np.cumsum(sizes[:, order], axis=1).min(axis=0)
    enough = np.flatnonzero(least >= ratio**2)
    return int(enough[0]) + 1 if len(enough) else None


def telling_order(
    information: FloatArray, prior: FloatArray, count: int, each: int = 4
) -> list[int]:
    """So many drives, each the one that leaves the smallest ellipses with those before (A-optimal:
    Pukelsheim 1993).

    ``information`` (n_drive, p, p) of each drive on touches, and ``prior`` (p, p) what is known
    before; a touch has so many parameters, ``each``, and the first two are its position.
    """
    order: list[int] = []
    known = prior
    places = [number for number in range(len(prior)) if number % each < 2]
    while len(order) < min(count, len(information)):
        rest = [drive for drive in range(len(information)) if drive not in order]
        spread = [
            float(np.trace(np.linalg.inv(known + information[drive])[np.ix_(places, places)]))
            for drive in rest
        ]
        best = rest[int(np.argmin(spread))]
        order.append(best)
        known = known + information[best]
    return order
