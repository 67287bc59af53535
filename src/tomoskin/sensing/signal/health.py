"""Electrode health, in records; the measurements of each electrode, and which are lost by it."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Self

import numpy as np
from numpy.typing import NDArray

from tomoskin.core import FloatArray
from tomoskin.model.pattern import Pattern

STATES = ("good", "open", "short", "railed", "stuck", "noisy", "inconsistent", "offset")
"""States of an electrode. open: no current and no reading; railed: cannot be read, but drives;
inconsistent: violates reciprocity; offset: has a voltage of its own, which an alternating drive
takes out, so that it is used as before."""

_ALL = 0.9
"""An electrode explains bad rows when at least this part of its own are bad: the rest may look
well by chance."""

Mask = NDArray[np.bool_]


@dataclass(frozen=True, slots=True)
class ElectrodeHealth:
    """One electrode: ``electrode`` from 0, its ``state`` of :data:`STATES`, the ``reason`` in
    words and numbers, and ``since`` when in the frames' seconds (None while good)."""

    electrode: int
    state: str = "good"
    reason: str = ""
    since: float | None = None

    @property
    def text(self) -> str:
        """The electrode in words: "E5 is open: …"."""
        return f"E{self.electrode + 1} is {self.state}: {self.reason}"


@dataclass(frozen=True, eq=False)
class Health:
    """All electrodes in one frame.

    Attributes
    ----------
    electrodes
        One for each, in order.
    lost
        (n_meas,) bool: rows of this frame that do not count.
    floating
        (n_electrodes,) bool: electrodes whose readings are any number. Rows that share such a
        reading still count in their sum: see :func:`tomoskin.sensing.signal.nuisance_directions`.
    """

    electrodes: tuple[ElectrodeHealth, ...]
    lost: NDArray[np.bool_]
    floating: NDArray[np.bool_]

    @cached_property
    def sick(self) -> tuple[ElectrodeHealth, ...]:
        """The electrodes that are not good."""
        return tuple(e for e in self.electrodes if e.state != "good")

    @property
    def text(self) -> str | None:
        """What is wrong, in a sentence, or None."""
        sick = self.sick
        return "; ".join(e.text for e in sick) if sick else None


@dataclass(frozen=True, eq=False)
class Roles:
    """(n_electrodes, n_meas) bool: rows in which each electrode is driven, and is read."""

    drives: Mask
    reads: Mask

    @classmethod
    def of(cls, pattern: Pattern) -> Self:
        """The roles that a pattern's rows give."""
        each = np.arange(pattern.n_electrodes)[:, None, None]
        return cls((pattern.drive == each).any(axis=2), (pattern.measure == each).any(axis=2))

    def blamed(self, bad: Mask) -> dict[int, str]:
        """Electrode → "open" or "railed": the fewest that explain the ``bad`` rows, (n_meas,).

        Greedy cover, then without those that the others make superfluous: between two broken
        electrodes stands a good one whose every row is bad.
        """
        offers = self._offers(bad)
        chosen: dict[int, str] = {}
        unexplained = bad.copy()
        while offers:
            best = max(offers, key=lambda e: int((offers[e][1] & unexplained).sum()))
            state, rows = offers.pop(best)
            if not (rows & unexplained).any():
                break
            chosen[best] = state
            unexplained &= ~rows
        for electrode in list(chosen):
            others = [self.rows(e, s) for e, s in chosen.items() if e != electrode]
            mine = bad & self.rows(electrode, chosen[electrode])
            if others and not (mine & ~np.any(others, axis=0)).any():
                del chosen[electrode]
        return chosen

    def rows(self, electrode: int, state: str) -> Mask:
        """(n_meas,) rows that an electrode in that state takes with it."""
        reads = self.reads[electrode]
        return np.asarray(reads if state in ("railed", "stuck") else reads | self.drives[electrode])

    def _offers(self, bad: Mask) -> dict[int, tuple[str, Mask]]:
        driven, read = _share(self.drives, bad), _share(self.reads, bad)
        offers = {}
        for electrode in np.flatnonzero((driven >= _ALL) | (read >= _ALL)).tolist():
            state = "open" if driven[electrode] >= _ALL else "railed"
            offers[electrode] = (state, self.rows(electrode, state))
        return offers


def _share(rows: Mask, bad: Mask) -> FloatArray:
    count = rows.sum(axis=1)
    return np.asarray((rows & bad).sum(axis=1) / np.maximum(count, 1) * (count > 0))


def nuisance_directions(pattern: Pattern, lost: Mask, floating: Mask) -> FloatArray:
    """(n_meas, k) nuisance directions of the data.

    A ``lost`` row, (n_meas,) bool, is one. A reading of a ``floating`` electrode,
    (n_electrodes,) bool, is an unknown number that the rows of its drive share: their sum, the
    voltage between its neighbours, still counts.
    """
    single = np.eye(pattern.n_meas)[:, lost]
    shared = []
    for electrode in np.flatnonzero(floating).tolist():
        plus, minus = (pattern.measure == electrode).T.astype(float)
        sign = np.where(lost, 0.0, plus - minus)
        for drive in np.unique(pattern.drive_index[sign != 0]):
            shared.append(np.where(pattern.drive_index == drive, sign, 0.0))
    return np.column_stack([single, *shared])
