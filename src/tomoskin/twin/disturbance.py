"""What a script breaks, and when: contacts, the converter, the line, the board, the room."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field, replace

from tomoskin.twin.faults import FaultEvent, Faults, happen
from tomoskin.twin.line import LineSettings

_BREAKS = ("cut", "short", "rail")
_AT_ONCE = ("reboot", "temperature")
"""Kinds that happen at a moment; all others last from ``start`` to ``end``."""


@dataclass(frozen=True)
class ScriptedFault:
    """A fault of a script.

    Attributes
    ----------
    kind
        "cut", "short", "rail", "noise", "loss", "corruption", "delay", "reboot", "temperature".
    start, end
        s since the end of the lead-in; equal for what happens at a moment.
    electrode, other
        Of cut, short and rail; −1 where there is none.
    amount
        LSB of noise, a probability of the line, or kelvin.
    where
        Place in the script, for messages.
    """

    kind: str
    start: float
    end: float
    electrode: int
    other: int
    amount: float
    where: str


@dataclass(frozen=True)
class Disturbance:
    """All that is wrong at a moment.

    ``noise`` LSB of one conversion, None where it is the twin's own; ``warmer`` K.
    """

    faults: Faults = field(default_factory=Faults)
    line: LineSettings = field(default_factory=LineSettings)
    noise: float | None = None
    warmer: float = 0.0


NONE = Disturbance()
"""All is well."""


def disturbed(faults: Iterable[ScriptedFault], time: float) -> Disturbance:
    """What is wrong at ``time`` s; of two of a kind that set a number, the later one counts."""
    found = NONE
    for fault in sorted(faults, key=lambda fault: fault.start):
        if fault.kind == "temperature" and fault.start <= time:
            found = replace(found, warmer=found.warmer + fault.amount)
        elif fault.start <= time < fault.end:
            found = _with(found, fault)
    return found


def reboots(faults: Iterable[ScriptedFault], since: float, time: float) -> bool:
    """Whether the board loses its power after ``since``, up to ``time`` s."""
    return any(fault.kind == "reboot" and since < fault.start <= time for fault in faults)


def _with(found: Disturbance, fault: ScriptedFault) -> Disturbance:
    if fault.kind in _BREAKS:
        event = FaultEvent(fault.start, fault.kind, fault.electrode, fault.other)
        return replace(found, faults=happen(found.faults, event))
    match fault.kind:
        case "noise":
            return replace(found, noise=fault.amount)
        case "loss":
            return replace(found, line=replace(found.line, loss=fault.amount))
        case "corruption":
            return replace(found, line=replace(found.line, corruption=fault.amount))
        case _:
            return replace(found, line=replace(found.line, hold=fault.amount))
