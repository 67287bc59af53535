"""What breaks on a skin, its board and its line, and when."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tomoskin.core import ModelError
from tomoskin.twin.parameters import parameter


@dataclass(frozen=True, slots=True)
class Faults:
    """What is broken now.

    Attributes
    ----------
    cut
        Electrodes whose wire is broken.
    shorts
        Pairs of electrodes that touch, the lower one first.
    railed
        Channels that stand at their upper rail.
    """

    cut: frozenset[int] = frozenset()
    shorts: frozenset[tuple[int, int]] = frozenset()
    railed: frozenset[int] = frozenset()


@dataclass(frozen=True, slots=True)
class LineSettings:
    """What the line does to the bytes of the board; nothing by default."""

    loss: float = parameter(0.0, "", "Probability that a byte is lost.", "ideal")
    corruption: float = parameter(
        0.0, "", "Probability that a byte arrives with one bit flipped.", "ideal"
    )
    hold: float = parameter(
        0.0,
        "",
        "Probability that bytes that have arrived are delayed until the next read.",
        "ideal",
    )

    def __post_init__(self) -> None:
        """Check that every probability is in its range."""
        for name in ("loss", "corruption", "hold"):
            value = getattr(self, name)
            if not 0 <= value < 1:
                raise ModelError(
                    f"expected {name} from 0 to below 1, got {value}", where="LineSettings"
                )

    @property
    def perfect(self) -> bool:
        """Whether every byte arrives, as it was sent and in time."""
        return self.loss == self.corruption == self.hold == 0


class Line:
    """The line, read by read; the same seed does the same to the same bytes."""

    def __init__(self, settings: LineSettings, seed: int) -> None:
        self.settings = settings
        self._random = np.random.default_rng(seed)
        self._held = b""

    def carry(self, data: bytes) -> bytes:
        """What arrives when the board sends ``data``."""
        arrived = self._held + (data if self.settings.perfect else self._spoiled(data))
        self._held = b""
        if arrived and self.settings.hold and self._random.random() < self.settings.hold:
            self._held, arrived = arrived, b""
        return arrived

    def _spoiled(self, data: bytes) -> bytes:
        sent = np.frombuffer(data, dtype=np.uint8)
        chance = self._random.random((2, len(sent)))
        bit = self._random.integers(0, 8, len(sent))
        flipped = np.where(chance[0] < self.settings.corruption, sent ^ (1 << bit), sent)
        arrived = flipped[chance[1] >= self.settings.loss].astype(np.uint8)
        return bytes(arrived)


def check_electrodes(faults: Faults, n: int) -> None:
    """Raise ModelError for an electrode that a skin with ``n`` does not have."""
    named = faults.cut | faults.railed | {e for pair in faults.shorts for e in pair}
    wrong = sorted(e for e in named if e >= n)
    if wrong:
        raise ModelError(
            f"expected electrodes from 0 (E1) to {n - 1}, got {wrong[0]}", where="twin: fault"
        )
