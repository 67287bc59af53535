"""Tables of drives and measurements as other programs write them → source, sink; plus, minus."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from tomoskin.core import DataError, IntArray
from tomoskin.files.imports import checked_currents


def drives_of(patterns: NDArray[Any], what: str, source: str) -> NDArray[Any]:
    """(n, 2) source and sink of (n, n_electrodes) patterns, or these currents as they are.

    Raises DataError for what does not sum to zero.
    """
    if ((patterns != 0.0).sum(axis=1) == 2).all() or patterns.shape[1] <= 2:
        return pairs_of(patterns, what, source)
    checked_currents(patterns, what, source)
    return patterns


def pairs_of(patterns: NDArray[Any], what: str, source: str) -> IntArray:
    """(n, 2) positive and negative electrode of each of (n, n_electrodes) patterns.

    Raises
    ------
    DataError
        When a pattern is not one electrode against one other of equal strength.
    """
    signs = np.sign(patterns)
    balanced = np.abs(patterns.sum(axis=1)) <= 1e-9 * np.abs(patterns).max(initial=0.0)
    good = ((signs > 0).sum(axis=1) == 1) & ((signs < 0).sum(axis=1) == 1) & balanced
    if not good.all():
        row = int(np.argmin(good))
        used = ", ".join(f"E{e + 1}" for e in np.flatnonzero(patterns[row])) or "none"
        raise DataError(
            f"expected one electrode against one other, got a pattern on {used}",
            where=f"{source}, {what} {row}",
            hint="tomoskin cannot reconstruct images from such patterns",
        )
    return np.column_stack([signs.argmax(axis=1), signs.argmin(axis=1)])


def neighbours(n: int) -> IntArray:
    """(n, 2) each electrode and the next."""
    e = np.arange(n)
    return np.column_stack([e, (e + 1) % n])


def scan_of(
    drives: IntArray, pairs: IntArray
) -> tuple[tuple[IntArray, IntArray], NDArray[np.bool_]]:
    """Rows of a scan of all ``pairs`` (m, 2) under each of ``drives`` (k, 2) that touch no driven
    electrode, drive and measure; and (k·m,) which of its values these are."""
    drive, measure = np.repeat(drives, len(pairs), axis=0), np.tile(pairs, (len(drives), 1))
    kept = ~touches_drive(drive, measure)
    return (drive[kept], measure[kept]), kept


def touches_drive(drive: IntArray, measure: IntArray) -> NDArray[np.bool_]:
    """(n,) whether a row's measuring pair touches its drive."""
    return np.asarray((drive[:, :, None] == measure[:, None, :]).any(axis=(1, 2)))


def adjacent_scan(n: int) -> tuple[tuple[IntArray, IntArray], NDArray[np.bool_]]:
    """The scan of neighbouring pairs as built-in patterns name their ends: sink k, source k + 1."""
    return scan_of(neighbours(n)[:, ::-1], neighbours(n))


def for_magnitudes(drive: IntArray, measure: IntArray, n: int) -> IntArray:
    """``measure`` with each pair so turned that a uniform disc of ``n`` electrodes reads above 0.

    For instruments that tell a voltage's size but not its sign. Potential of point electrodes on
    the rim of a disc: −ln|z − source| + ln|z − sink| (Gisser, Isaacson, Newell 1990).
    """
    place = np.exp(2j * np.pi * np.arange(n) / n)
    source, sink = place[drive[:, 0]], place[drive[:, 1]]

    def potential(electrode: IntArray) -> NDArray[np.float64]:
        z = place[electrode]
        near = 1e-6  # a driven electrode's own potential is large, not infinite
        return np.asarray(
            np.log(np.maximum(abs(z - sink), near)) - np.log(np.maximum(abs(z - source), near))
        )

    falls = potential(measure[:, 0]) < potential(measure[:, 1])
    return np.where(falls[:, None], measure[:, ::-1], measure)


def clockwise(number: IntArray, n: int) -> IntArray:
    """Electrodes counted counter-clockwise from the top, as the built-in skins count them."""
    return np.asarray(-number % n)
