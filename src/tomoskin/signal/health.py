"""What is wrong with electrodes, in records that a person and a program can read."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

STATES = ("good", "open", "short", "railed", "stuck", "noisy", "inconsistent")
"""States of an electrode. open: no current and no reading; railed: cannot be read, but drives;
inconsistent: violates reciprocity."""


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
        """In words: "E5 is open: …"."""
        return f"E{self.electrode + 1} is {self.state}: {self.reason}"


@dataclass(frozen=True, slots=True, eq=False)
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
        reading still count in their sum: see :func:`tomoskin.signal.lost_directions`.
    """

    electrodes: tuple[ElectrodeHealth, ...]
    lost: NDArray[np.bool_]
    floating: NDArray[np.bool_]

    @property
    def sick(self) -> tuple[ElectrodeHealth, ...]:
        """Those that are not good."""
        return tuple(e for e in self.electrodes if e.state != "good")

    @property
    def text(self) -> str | None:
        """What is wrong, in a sentence, or None."""
        sick = self.sick
        return "; ".join(e.text for e in sick) if sick else None
