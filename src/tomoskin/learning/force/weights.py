"""Weights as people name them, in newtons; a question where a unit was probably mistaken."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Self

from tomoskin.core import DataError
from tomoskin.learning.force.presses import MOST_NEWTONS

NEWTONS: Mapping[str, float] = MappingProxyType({"N": 1.0, "g": 9.80665e-3, "kg": 9.80665})
"""Newtons in one of each unit."""

_HEAVY, _LIGHT = 15.0, 0.02
"""Newtons above which "N", and below which "g", was probably meant otherwise: a hand presses with
0.1 to 15 N, and what is lighter than 2 g hardly shows."""

_MEANT = {"N": "g", "g": "kg"}


@dataclass(frozen=True)
class Weight:
    """What lies on the skin: ``value`` in ``unit``, one of :data:`NEWTONS`."""

    value: float
    unit: str

    def checked(self) -> Self:
        """Itself. Raises DataError where nothing can be learnt from such a weight."""
        if 0 < self.newtons <= MOST_NEWTONS:
            return self
        raise DataError(
            f"expected a weight above 0 and up to {MOST_NEWTONS:g} N, got {self.text}",
            hint="1 N is the weight of 102 g: check the unit",
        )

    @property
    def newtons(self) -> float:
        """Force, N."""
        return self.value * NEWTONS[self.unit]

    @property
    def text(self) -> str:
        """For people, with the force where another unit was given."""
        own = f"{self.value:.6g} {self.unit}"
        return own if self.unit == "N" else f"{own} ({self.newtons:.3g} N)"

    @property
    def meant(self) -> Weight | None:
        """The weight that was probably meant, where this one is unusual; else None."""
        newtons = self.newtons
        unusual = newtons > _HEAVY if self.unit == "N" else newtons < _LIGHT
        if not unusual or self.unit not in _MEANT:
            return None
        return Weight(self.value, _MEANT[self.unit])
