"""What can be learnt of a touch as one number: a force from weights, a depth from known travels; as
people name them, in units, and checked."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from types import MappingProxyType
from typing import Self

import numpy as np

from tomoskin.core import DIMENSIONS, MEASURANDS, DataError, FloatArray

_PROBABLE = {"N": "g", "g": "kg"}
_HEAVY, _LIGHT = 15.0, 0.02
"""Newtons above which "N", and below which "g", was probably meant otherwise: a hand presses with
0.1 to 15 N, and what is lighter than 2 g hardly shows."""


@dataclass(frozen=True)
class Measurand:
    """A quantity of a touch, across the sheet.

    Attributes
    ----------
    name, plural
        One of :data:`~tomoskin.core.MEASURANDS`; of many.
    units
        Size in SI of each unit in which labels are given.
    shown
        The one of these in which people are told of it.
    least, most
        Where all labels are less, or one is more, their unit is another one, SI.
    slip
        What is wrong with labels beyond ``most``, in words.
    labels
        What labels are, in words.
    bends
        Powers of F/(F + F₀) by which a touch may go with the amount F. A force levels off, since
        the layer is squeezed solid in the end; a depth has had that already.
    halves
        F₀ over the median of the labels.
    """

    name: str
    plural: str
    units: Mapping[str, float]
    shown: str
    least: float
    most: float
    slip: str
    labels: str
    bends: tuple[float, ...] = (1.0,)
    halves: tuple[float, ...] = field(default=tuple(np.geomspace(0.02, 50.0, 41)))

    def text(self, value: float, digits: int = 3) -> str:
        """The amount ``value``, SI, for people."""
        return f"{value / self.units[self.shown]:.{digits}g} {self.shown}"

    def span(self, values: FloatArray) -> str:
        """From the smallest to the largest of ``values``, SI."""
        return f"{values.min() / self.units[self.shown]:.2g} to {self.text(values.max(), 2)}"

    @cached_property
    def key(self) -> str:
        """Its labels in an interchange file, and its column in a table of touches."""
        return f"{self.name}_{MEASURANDS[self.name].lower()}"

    @cached_property
    def where(self) -> str:
        """Where its labels are, for messages."""
        return f"{self.name} labels"


_FORCE = Measurand(
    name="force",
    plural="forces",
    units=MappingProxyType({"N": 1.0, "g": 9.80665e-3, "kg": 9.80665}),
    shown="N",
    least=1e-3,
    most=100.0,
    slip="a touch has 0.1 to 50 N, so these values are probably grams: convert them with --unit g, "
    "1 N is the weight of 102 g",
    labels="weights",
)
"""Newtons: a sheet that bears more than a hundred is not what this is for."""

_DEPTH = Measurand(
    name="depth",
    plural="depths",
    units=MappingProxyType(DIMENSIONS["length"]),
    shown="mm",
    least=1e-5,
    most=0.1,
    slip="a sheet gives way by 0.05 to 50 mm, so these values are probably millimetres: convert "
    "them with --unit mm",
    labels="depths",
    bends=tuple(np.linspace(0.6, 1.8, 13)),
    halves=(10.0,),
)
"""Metres by which the sheet gives way under the tip."""

MEASURED = {one.name: one for one in (_FORCE, _DEPTH)}
"""By their names."""


@dataclass(frozen=True)
class AmountLabel:
    """What a person says of a press: ``value`` in ``unit``, one of those ``of`` the measurand."""

    value: float
    unit: str
    of: Measurand = _FORCE

    def checked(self, layer: float | None = None) -> Self:
        """Itself. Raises DataError where nothing can be learnt from it, as from a depth beyond the
        ``layer`` m that is pressed."""
        of, within = self.of, ""
        most = of.most
        if of is _DEPTH and layer is not None:
            most, within = layer, ", the layer under the sheet"
        if self.unit in of.units and 0 < self.si <= most:
            return self
        raise DataError(
            f"expected a {of.labels[:-1]} above 0 and up to {of.text(most)}{within}, got "
            f"{self.value:.6g} {self.unit}",
            hint="1 N is the weight of 102 g: check the unit" if of is _FORCE else "",
        )

    @property
    def si(self) -> float:
        """The amount in the SI unit of its kind."""
        return self.value * self.of.units[self.unit]

    @property
    def text(self) -> str:
        """For people, with the usual unit where another one was given."""
        own = f"{self.value:.6g} {self.unit}"
        return own if self.unit == self.of.shown else f"{own} ({self.of.text(self.si)})"

    @property
    def meant(self) -> AmountLabel | None:
        """The weight that was probably meant, where this one is unusual; else None."""
        if self.value <= 0 or self.of is not _FORCE or self.unit not in _PROBABLE:
            return None
        unusual = self.si > _HEAVY if self.unit == "N" else self.si < _LIGHT
        return AmountLabel(self.value, _PROBABLE[self.unit]) if unusual else None
