"""Who is who: hypotheses of which touch goes on as which, with their probabilities and numbers."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass

from tomoskin.core import Touch
from tomoskin.sensing.track.position import TouchStrength
from tomoskin.sensing.track.trace import Trace

SURE = 0.8
"""Probability from which an identity is said without any other."""

_RULED_OUT = 0.01
"""Probability below which a hypothesis is dropped."""

_MOST = 8


@dataclass(frozen=True, slots=True)
class IdentityHypothesis:
    """One hypothesis: ``names`` {member: identity}, and the logarithm of its weight."""

    weight: float
    names: Mapping[int, int]

    def exchanged(self, one: int, other: int, odds: float) -> IdentityHypothesis:
        """With two members' names the other way round."""
        names = {**self.names, one: self.names[other], other: self.names[one]}
        return IdentityHypothesis(self.weight + odds, names)


Namings = tuple[IdentityHypothesis, ...]

NOBODY: Namings = (IdentityHypothesis(0.0, {}),)


def begun(namings: Namings, member: int) -> Namings:
    """With a new ``member``, whose identity is its own."""
    return tuple(IdentityHypothesis(n.weight, {**n.names, member: member}) for n in namings)


def ended(namings: Namings, members: Sequence[int]) -> Namings:
    """Without ``members``, who went as what they are held to be."""
    best = namings[0].names
    kept = [n for n in namings if all(n.names[m] == best[m] for m in members)]
    rest = [{m: i for m, i in n.names.items() if m not in members} for n in kept]
    return _bounded(
        [IdentityHypothesis(n.weight, names) for n, names in zip(kept, rest, strict=True)]
    )


def exchanged(namings: Namings, one: int, other: int, odds: float) -> Namings:
    """Where two members may have changed places: log ``odds`` of that."""
    turned = [n.exchanged(one, other, odds) for n in namings]
    return _bounded([*namings, *turned])


def judged(namings: Namings, evidence: Callable[[IdentityHypothesis], float]) -> Namings:
    """The most likely first, by what speaks for each; those that are ruled out are dropped."""
    if len(namings) == 1:
        return namings
    total = {id(n): n.weight + evidence(n) for n in namings}
    most = max(total.values())
    kept = [n for n in namings if total[id(n)] >= most + math.log(_RULED_OUT)]
    return tuple(sorted(kept, key=lambda n: -total[id(n)]))


def probabilities(namings: Namings, evidence: Callable[[IdentityHypothesis], float]) -> list[float]:
    """Of each hypothesis."""
    if len(namings) == 1:
        return [1.0]
    logs = [n.weight + evidence(n) for n in namings]
    odds = [math.exp(value - max(logs)) for value in logs]
    return [value / sum(odds) for value in odds]


def _bounded(namings: Sequence[IdentityHypothesis]) -> Namings:
    """Equal ones as one, the likeliest first, and no more than there may be."""
    sums: dict[tuple[tuple[int, int], ...], float] = {}
    for naming in namings:
        key = tuple(sorted(naming.names.items()))
        sums[key] = _log_sum(sums[key], naming.weight) if key in sums else naming.weight
    most = max(sums.values())
    found = [IdentityHypothesis(weight - most, dict(key)) for key, weight in sums.items()]
    return tuple(sorted(found, key=lambda naming: -naming.weight)[:_MOST])


def _log_sum(one: float, other: float) -> float:
    high, low = max(one, other), min(one, other)
    return high + math.log1p(math.exp(low - high))


_MOVED, _BY_DEVIATIONS = 0.003, 3.0
"""A touch moves when it is so many metres, and deviations, from where it was last reported."""

_POSSIBLE = 0.05
"""Probability from which another identity is said beside the likeliest."""


class IdentityLedger:
    """Identities of fingers: each has a key while it is followed. A hypothesis says which key has
    which name, a name being the key that a finger began with; and each name has a number.

    Attributes
    ----------
    numbered
        The last number that was given.
    """

    def __init__(self) -> None:
        self.numbered = 0
        self.forget()

    def forget(self) -> None:
        """Forget all; numbers go on."""
        self._namings = NOBODY
        self._numbers: dict[int, int] = {}
        self._began: dict[int, float] = {}
        self._strengths: dict[int, TouchStrength] = {}
        self._reported_at: dict[int, tuple[float, float]] = {}

    def begin(self, key: int, since: float) -> None:
        """Give a finger a number that began at a host time, s."""
        self.numbered += 1
        self._numbers[key], self._began[key] = self.numbered, since
        self._namings = begun(self._namings, key)

    @property
    def sure(self) -> bool:
        """Whether there is no doubt who is who."""
        return len(self._namings) == 1

    def exchange(self, one: int, other: int, odds: float) -> None:
        """Two may have changed places: log ``odds`` of that."""
        self._namings = exchanged(self._namings, one, other, odds)

    def judge(self, traces: Sequence[Trace]) -> None:
        """Let the strengths of fingers that stand alone say which hypothesis is right; and note
        those of which it is sure who they are."""
        if not self.sure:
            fresh = _fresh(traces)
            self._namings = judged(self._namings, lambda n: self._evidence(n, fresh))
        for trace in traces:
            if trace.reported and trace.missing is None and len(trace.members) == 1:
                key, name = trace.key, self.name(trace.key)
                if self.sure or all(naming.names[key] == name for naming in self._namings):
                    self._strengths[name] = trace.strength

    def name(self, key: int) -> int:
        """Of a finger, by the likeliest hypothesis."""
        return self._namings[0].names[key]

    def touches(self, shown: Sequence[Trace], traces: Sequence[Trace]) -> list[Touch]:
        """Those ``shown`` of all ``traces`` as they are reported: a merged one by the oldest of
        its numbers."""
        parts = [1.0]
        if not self.sure:
            fresh = _fresh(traces)
            parts = probabilities(self._namings, lambda n: self._evidence(n, fresh))
        return [self._touch(trace, parts) for trace in shown]

    def end(self, trace: Trace) -> Iterator[Touch]:
        """As they were last, of the fingers that one stood for: nobody else can be them any more,
        and a run may last for weeks."""
        keys = [member.key for member in trace.members]
        shown = trace.shown
        for name in sorted(map(self.name, keys)):
            number, began = self._numbers.pop(name), self._began.pop(name)
            self._strengths.pop(name, None)
            self._reported_at.pop(number, None)
            yield Touch(number, trace.kind, began, shown)
        self._namings = ended(self._namings, keys)

    def place(self, touch: Touch) -> None:
        """Note where a touch has been reported."""
        self._reported_at[touch.id] = touch.detection.x, touch.detection.y

    def moved(self, touch: Touch, wavers: float) -> bool:
        """Whether a touch has left where it was last reported; ``wavers``: its deviation, m."""
        x, y = touch.detection.x, touch.detection.y
        before = self._reported_at.setdefault(touch.id, (x, y))
        far = math.hypot(x - before[0], y - before[1])
        return far > _MOVED and not far < _BY_DEVIATIONS * wavers

    def _touch(self, trace: Trace, parts: Sequence[float]) -> Touch:
        keys = [member.key for member in trace.members]
        names = sorted([self.name(key) for key in keys])
        numbers = tuple(sorted([self._numbers[name] for name in names]))
        return Touch(
            numbers[0],
            trace.kind,
            self._began[names[0]],
            trace.shown,
            numbers if len(numbers) > 1 else (),
            () if self.sure else self._possible(keys, parts),
        )

    def _possible(self, keys: Sequence[int], parts: Sequence[float]) -> tuple[int, ...]:
        """Numbers that fingers may have, where it is not sure which."""
        weights: dict[tuple[int, ...], float] = {}
        for naming, part in zip(self._namings, parts, strict=True):
            group = tuple(sorted([naming.names[key] for key in keys]))
            weights[group] = weights.get(group, 0.0) + part
        if next(iter(weights.values())) >= SURE:
            return ()
        possible = {n for group, part in weights.items() if part > _POSSIBLE for n in group}
        return tuple(sorted([self._numbers[name] for name in possible]))

    def _evidence(self, naming: IdentityHypothesis, fresh: Mapping[int, TouchStrength]) -> float:
        """What strengths say for a hypothesis."""
        said = 0.0
        for key, strength in fresh.items():
            before = self._strengths.get(naming.names[key])
            if before is not None:
                said += strength.log_likelihood(before)
        return said


def _fresh(traces: Sequence[Trace]) -> dict[int, TouchStrength]:
    """{key: strength} of fingers that stand alone, since they did."""
    return {t.key: t.fresh for t in traces if t.reported and len(t.members) == 1}
