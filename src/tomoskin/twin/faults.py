"""What breaks on a skin, its board and its line, and when: by events, or by a script."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace

from tomoskin.core import ModelError
from tomoskin.twin.line import LineSettings

KINDS = ("cut", "restore", "short", "unshort", "rail", "unrail")
"""Events: an electrode's wire breaks or is mended, two electrodes touch or part, a channel
stands at its rail or works again."""


_OF_WIRES = ("cut", "short", "rail")
"""Kinds of a script's faults that are events too."""


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
class FaultEvent:
    """One of :data:`KINDS` at ``time`` s, of ``electrode`` (with ``other``, for a short).

    Raises
    ------
    ModelError
        For an unknown kind, a time that is not finite, electrodes below 0, or a short of an
        electrode with itself.
    """

    time: float
    kind: str
    electrode: int
    other: int = -1

    def __post_init__(self) -> None:
        """Check the values."""
        where = f"fault at {self.time} s"
        if self.kind not in KINDS:
            raise ModelError(
                f'expected a kind among {", ".join(KINDS)}, got "{self.kind}"', where=where
            )
        if not math.isfinite(self.time):
            raise ModelError(f"expected a finite time, got {self.time}", where=where)
        pair = self.kind in ("short", "unshort")
        if self.electrode < 0 or (pair and (self.other < 0 or self.other == self.electrode)):
            raise ModelError(
                "expected "
                f"{'two different electrodes' if pair else 'an electrode'} from 0 (E1), got "
                f"{(self.electrode, self.other) if pair else self.electrode}",
                where=where,
            )


def happen(faults: Faults, event: FaultEvent) -> Faults:
    """What is broken after ``event``."""
    one = frozenset({event.electrode})
    low, high = sorted((event.electrode, event.other))
    pair = frozenset({(low, high)})
    match event.kind:
        case "cut":
            return replace(faults, cut=faults.cut | one)
        case "restore":
            return replace(faults, cut=faults.cut - one)
        case "short":
            return replace(faults, shorts=faults.shorts | pair)
        case "unshort":
            return replace(faults, shorts=faults.shorts - pair)
        case "rail":
            return replace(faults, railed=faults.railed | one)
        case _:
            return replace(faults, railed=faults.railed - one)


def faults_at(events: Sequence[FaultEvent], time: float) -> Faults:
    """What is broken at ``time`` s: everything up to and at that time has happened, in order."""
    faults = Faults()
    for event in sorted(events, key=lambda event: event.time):
        if event.time <= time:
            faults = happen(faults, event)
    return faults


def check_electrodes(faults: Faults, n: int) -> None:
    """Raise ModelError for an electrode that a skin with ``n`` does not have."""
    named = faults.cut | faults.railed | {e for pair in faults.shorts for e in pair}
    wrong = sorted(e for e in named if e >= n)
    if wrong:
        raise ModelError(
            f"expected electrodes from 0 (E1) to {n - 1}, got {wrong[0]}", where="twin: fault"
        )


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


def disturbed(faults: Iterable[ScriptedFault], time: float) -> Disturbance:
    """What is wrong at ``time`` s; of two of a kind that set a number, the later one counts."""
    now = Disturbance()
    for fault in sorted(faults, key=lambda fault: fault.start):
        if fault.kind == "temperature" and fault.start <= time:
            now = replace(now, warmer=now.warmer + fault.amount)
        elif fault.start <= time < fault.end:
            now = _with(now, fault)
    return now


def reboots(faults: Iterable[ScriptedFault], since: float, time: float) -> bool:
    """Whether the board loses its power after ``since``, up to ``time`` s."""
    return any(fault.kind == "reboot" and since < fault.start <= time for fault in faults)


def _with(now: Disturbance, fault: ScriptedFault) -> Disturbance:
    if fault.kind in _OF_WIRES:
        event = FaultEvent(fault.start, fault.kind, fault.electrode, fault.other)
        return replace(now, faults=happen(now.faults, event))
    match fault.kind:
        case "noise":
            return replace(now, noise=fault.amount)
        case "loss":
            return replace(now, line=replace(now.line, loss=fault.amount))
        case "corruption":
            return replace(now, line=replace(now.line, corruption=fault.amount))
        case _:
            return replace(now, line=replace(now.line, hold=fault.amount))
