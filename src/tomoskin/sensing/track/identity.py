"""Who is who: hypotheses of which touch goes on as which, with their probabilities and numbers."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import NamedTuple

from tomoskin.core import Touch
from tomoskin.sensing.track.position import TouchStrength
from tomoskin.sensing.track.trace import Trace

SURE = 0.8
"""Probability from which an identity is said without any other."""

_RULED_OUT = 0.01
"""Probability below which a hypothesis is dropped."""

_MOST = 8

_MOVED, _BY_DEVIATIONS = 0.003, 3.0
"""A touch moves when it is so many metres, and deviations, from where it was last reported."""

_POSSIBLE = 0.05
"""Probability from which another identity is said beside the likeliest."""


class IdentityHypothesis(NamedTuple):
    """One hypothesis: ``names`` {key: name}, and the logarithm of its weight."""

    weight: float
    names: Mapping[int, int]


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
        """Forget all fingers; numbers go on."""
        self._hypotheses = [IdentityHypothesis(0.0, {})]
        self._numbers: dict[int, int] = {}
        self._began: dict[int, float] = {}
        self._strengths: dict[int, TouchStrength] = {}
        self._reported_at: dict[int, tuple[float, float]] = {}

    def begin(self, key: int, since: float) -> None:
        """Give a finger a number that began at a host time, s."""
        self.numbered += 1
        self._numbers[key], self._began[key] = self.numbered, since
        self._hypotheses = [
            IdentityHypothesis(weight, {**names, key: key}) for weight, names in self._hypotheses
        ]

    @property
    def sure(self) -> bool:
        """Whether there is no doubt who is who."""
        return len(self._hypotheses) == 1

    def exchange(self, one: int, other: int, odds: float) -> None:
        """Two may have changed places: log ``odds`` of that."""
        turned = [
            IdentityHypothesis(weight + odds, {**names, one: names[other], other: names[one]})
            for weight, names in self._hypotheses
        ]
        self._hypotheses = _bounded([*self._hypotheses, *turned])

    def judge(self, traces: Sequence[Trace]) -> None:
        """Let the strengths of fingers that stand alone say which hypothesis is right; and note
        those of which it is sure who they are."""
        if not self.sure:
            weighed = list(zip(self._weights(traces), self._hypotheses, strict=True))
            least = max(weight for weight, _ in weighed) + math.log(_RULED_OUT)
            weighed.sort(key=lambda pair: -pair[0])
            self._hypotheses = [h for weight, h in weighed if weight >= least]
        for trace in traces:
            if trace.reported and trace.missing is None and len(trace.members) == 1:
                key, name = trace.key, self.name(trace.key)
                if all(names[key] == name for _, names in self._hypotheses):
                    self._strengths[name] = trace.strength

    def name(self, key: int) -> int:
        """Of a finger, by the likeliest hypothesis."""
        return self._hypotheses[0].names[key]

    def number(self, key: int) -> int:
        """The identity of a finger, by the likeliest hypothesis."""
        return self._numbers[self.name(key)]

    def touches(self, shown: Sequence[Trace], traces: Sequence[Trace]) -> list[Touch]:
        """Those ``shown`` of all ``traces`` as they are reported: a merged one by the oldest of
        its numbers."""
        parts = [1.0]
        if not self.sure:
            weights = self._weights(traces)
            odds = [math.exp(weight - max(weights)) for weight in weights]
            parts = [value / sum(odds) for value in odds]
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
        best = self._hypotheses[0].names
        self._hypotheses = _bounded(
            [
                IdentityHypothesis(weight, {k: name for k, name in names.items() if k not in keys})
                for weight, names in self._hypotheses
                if all(names[key] == best[key] for key in keys)
            ]
        )

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
        for (_, names), part in zip(self._hypotheses, parts, strict=True):
            group = tuple(sorted([names[key] for key in keys]))
            weights[group] = weights.get(group, 0.0) + part
        if next(iter(weights.values())) >= SURE:
            return ()
        possible = {n for group, part in weights.items() if part > _POSSIBLE for n in group}
        return tuple(sorted([self._numbers[name] for name in possible]))

    def _weights(self, traces: Sequence[Trace]) -> list[float]:
        """Of each hypothesis, with what the strengths of fingers that stand alone say for it."""
        fresh = {t.key: t.fresh for t in traces if t.reported and len(t.members) == 1}
        weights = []
        for weight, names in self._hypotheses:
            said = 0.0
            for key, strength in fresh.items():
                before = self._strengths.get(names[key])
                if before is not None:
                    said += strength.log_likelihood(before)
            weights.append(weight + said)
        return weights


def _bounded(hypotheses: Sequence[IdentityHypothesis]) -> list[IdentityHypothesis]:
    """Equal ones as one, the likeliest first, and no more than there may be."""
    sums: dict[tuple[tuple[int, int], ...], float] = {}
    for weight, names in hypotheses:
        key = tuple(sorted(names.items()))
        high, low = max(sums.get(key, -math.inf), weight), min(sums.get(key, -math.inf), weight)
        sums[key] = high + math.log1p(math.exp(low - high))
    most = max(sums.values())
    merged = [IdentityHypothesis(weight - most, dict(key)) for key, weight in sums.items()]
    return sorted(merged, key=lambda hypothesis: -hypothesis.weight)[:_MOST]
