"""Bends and stretches of a script: what the sheet does at a moment."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Self

import numpy as np

from tomoskin.core import FloatArray, GeometryError, ScriptError
from tomoskin.mesh import Arm, Hinge
from tomoskin.twin.bend import Bent, Deformation, Pose, Stretched
from tomoskin.twin.timeline import Rows, along


@dataclass(frozen=True)
class ScriptedBend:
    """A bend or stretch with the course of its amount.

    Attributes
    ----------
    kind
        "hinge", "joint" or "stretch".
    start
        s since the end of the lead-in.
    course
        Rows of (s since ``start``, rad or elongation), from 0 to 0.
    values
        The other keys of the script, in SI.
    where
        Place in the script, for messages.
    """

    kind: str
    start: float
    course: Rows
    values: Mapping[str, Any]
    where: str

    @classmethod
    def of(cls, kind: str, amount: str, value: Mapping[str, Any], where: str) -> Self:
        """From the values of a section whose key ``amount`` says how far.

        Raises ScriptError for a profile that does not end at nothing, and impossible shapes.
        """
        if "profile" in value:
            rows = value["profile"]
            if not rows[0][0] > 0 or rows[-1][1] != 0.0:
                raise ScriptError(
                    "expected times above 0 s, and nothing left in the last row",
                    where=f"{where} profile",
                    hint="it begins with nothing at 0 s by itself",
                )
            course: Rows = ((0.0, 0.0), *rows)
        else:
            up = value["rise"]
            held = up + value["hold"]
            most = value[amount]
            course = ((0.0, 0.0), (up, most), (held, most), (held + value["fall"], 0.0))
        made = cls(kind, value["start"], course, value, where)
        try:
            for _, most in course:
                made.shape(most)
        except GeometryError as error:
            raise ScriptError(error.message, where=where, hint=error.hint) from None
        return made

    @property
    def end(self) -> float:
        """When nothing is left, s."""
        return self.start + self.course[-1][0]

    def amount(self, time: float) -> float:
        """Rad or elongation at ``time`` s."""
        return float(along(self._course, time - self.start)[0])

    def shape(self, amount: float) -> Deformation:
        """What the sheet does at an ``amount``."""
        value = self.values
        if self.kind == "stretch":
            return Stretched(amount, value["across"] * amount, value["axis"])
        if self.kind == "joint":
            return Bent(Arm(value["radius"], amount, value["length"]))
        return Bent(Hinge(amount, value["length"], value["axis"], value["offset"]))

    def told(self, time: float) -> dict[str, float | str]:
        """The truth at ``time`` s, for the file."""
        amount = self.amount(time)
        axis = 0.0 if self.kind == "joint" else self.values["axis"]
        if self.kind == "stretch":
            return {"kind": self.kind, "strain": amount, "axis": axis}
        return {"kind": self.kind, "angle": amount, "axis": axis}

    @cached_property
    def _course(self) -> FloatArray:
        return np.array(self.course)


def bent(bends: Iterable[ScriptedBend], time: float) -> Pose:
    """How the sheet is bent and stretched at ``time`` s."""
    return tuple(bend.shape(bend.amount(time)) for bend in bends if bend.amount(time) != 0.0)


def bent_truth(bends: Iterable[ScriptedBend], time: float) -> list[dict[str, float | str]]:
    """The same in words, for the file."""
    return [bend.told(time) for bend in bends if bend.amount(time) != 0.0]
