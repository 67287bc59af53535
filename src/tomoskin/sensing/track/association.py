"""Which detection is of which touch: the most likely assignment, and what else may be."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple, Self

from scipy.optimize import linear_sum_assignment

from tomoskin.core import Detection
from tomoskin.sensing.track.event import TrackClock
from tomoskin.sensing.track.motion import (
    TrackObservation,
    TrackSettings,
    TrackState,
    begin,
    distance,
    observe,
    predict,
    update,
)
from tomoskin.sensing.track.policy import APART, EXCHANGED, GATE, JUMP, STRENGTH, confirmed, missed
from tomoskin.sensing.track.position import ELSEWHERE, NOISE, TouchStrength, log_content
from tomoskin.sensing.track.trace import Trace, sign_of

_PARTED = 0.02
"""How far from the middle of two, along each axis, what is seen of them may be, m."""

_LIMIT = 60.0
"""More than any pair costs."""


class ExpectedTouch(NamedTuple):
    """A touch as it is expected: ``odds``, a logarithm, that it is there, and whether it stands for
    ``several`` fingers."""

    state: TrackState
    sign: float
    strength: TouchStrength
    odds: float
    several: bool


class SeenDetection(NamedTuple):
    """A detection as it is compared: ``content`` is a logarithm."""

    position: TrackObservation
    sign: float
    content: float


@dataclass(frozen=True, slots=True)
class Association:
    """Pairs {detection: touch}; the touches that ``jumped`` with theirs to the middle of two; and
    (touch, touch, log odds) of ``exchanges`` that are not ruled out."""

    pairs: dict[int, int]
    jumped: frozenset[int]
    exchanges: tuple[tuple[int, int, float], ...]


NOTHING = Association({}, frozenset(), ())


def associate(expected: Sequence[ExpectedTouch], seen: Sequence[SeenDetection]) -> Association:
    """The likeliest (Kuhn 1955).

    A pair costs the logarithm of its likelihood: of position, strength and existence. Beyond the
    gate, and between signs, there are none. Where a detection is left over and a touch too, two of
    the touches may be seen as one in the middle of their contents.
    """
    cost = [_costs(touch, seen) for touch in expected]
    pairs = _least(cost)
    jumped: frozenset[int] = frozenset()
    if len(pairs) < min(len(expected), len(seen)) and len(expected) > 1:
        taken = set(pairs.values())
        more = _least(
            [
                [_LIMIT] * len(seen) if i in taken else _jumps(i, expected, seen, set(pairs))
                for i in range(len(expected))
            ]
        )
        pairs, jumped = pairs | more, frozenset(more.values())
    return Association(pairs, jumped, tuple(_exchanges(cost, pairs)))


def _costs(touch: ExpectedTouch, seen: Sequence[SeenDetection]) -> list[float]:
    """(m,) of one touch with each detection."""
    state = touch.state
    if touch.several:
        state = state._replace(xx=state.xx + _PARTED**2, yy=state.yy + _PARTED**2)
    there = math.log1p(math.exp(-touch.odds))
    costs = []
    for position, sign, content in seen:
        far, area = distance(state, position)
        if far > GATE or sign != touch.sign:
            costs.append(_LIMIT)
            continue
        apart = min(0.5 * _unlike(touch.strength, content), STRENGTH)
        cost = 0.5 * far + 0.5 * math.log(area / 1e-8) + apart + there
        costs.append(cost if cost <= APART else _LIMIT)
    return costs


def _jumps(
    own: int, expected: Sequence[ExpectedTouch], seen: Sequence[SeenDetection], taken: set[int]
) -> list[float]:
    """(m,) what it costs that a touch, the ``own``, and another one are seen together, by each
    detection that is not ``taken``."""
    touch = expected[own]
    others = [
        (_between(touch, other), touch.strength.plus(other.strength))
        for number, other in enumerate(expected)
        if number != own and other.sign == touch.sign
    ]
    costs = []
    for number, (position, sign, content) in enumerate(seen):
        nearest = math.inf
        if number not in taken and sign == touch.sign:
            away = (
                distance(state, position)[0] + _unlike(both, min(content, both.mean))
                for state, both in others
            )
            nearest = min(away, default=math.inf)
        # the stronger one goes on
        cost = JUMP + 0.5 * nearest - touch.strength.mean / 8
        costs.append(cost if nearest <= GATE else _LIMIT)
    return costs


def _unlike(strength: TouchStrength, content: float) -> float:
    """Squared deviations of a content from that of a touch."""
    return (content - strength.mean) ** 2 / (strength.variance + NOISE**2 + ELSEWHERE**2)


def _between(one: ExpectedTouch, other: ExpectedTouch) -> TrackState:
    """Where the middle of their contents is; its velocity is not needed."""
    share = 1 / (1 + math.exp(other.strength.mean - one.strength.mean))
    rest = 1 - share
    a, b = one.state, other.state
    return a._replace(
        x=share * a.x + rest * b.x,
        y=share * a.y + rest * b.y,
        xx=share**2 * a.xx + rest**2 * b.xx,
        xy=share**2 * a.xy + rest**2 * b.xy,
        yy=share**2 * a.yy + rest**2 * b.yy,
    )


def _least(cost: Sequence[Sequence[float]]) -> dict[int, int]:
    """{column: row} of the pairs whose sum is the least."""
    allowed = [(i, k) for i, row in enumerate(cost) for k, c in enumerate(row) if c < _LIMIT]
    pairs = {column: row for row, column in allowed}
    if len({row for row, _ in allowed}) == len(pairs) == len(allowed):
        return pairs  # nobody competes
    rows, columns = linear_sum_assignment(cost)
    found = zip(rows.tolist(), columns.tolist(), strict=True)
    return {column: row for row, column in found if cost[row][column] < _LIMIT}


def _exchanges(
    cost: Sequence[Sequence[float]], pairs: dict[int, int]
) -> list[tuple[int, int, float]]:
    found = list(pairs.items())
    open_ones = []
    for number, (a, i) in enumerate(found):
        for b, k in found[:number]:
            odds = cost[i][a] + cost[k][b] - cost[i][b] - cost[k][a]
            if odds > EXCHANGED and cost[i][b] < _LIMIT and cost[k][a] < _LIMIT:
                open_ones.append((i, k, min(odds, 0.0)))
    return open_ones


_PAUSE = 0.5
"""Seconds without frames, in which touches move; in a longer pause they stand: nobody looked."""


@dataclass(frozen=True, slots=True, eq=False)
class FrameOfTouches:
    """What a finder has seen.

    Attributes
    ----------
    detections
        Of one frame.
    seen
        The same as they are compared.
    strongest
        Their largest ratio to the noise; 0 where none is known.
    clock
        The moment.
    settings
        Of the tracker.
    """

    detections: Sequence[Detection]
    seen: Sequence[SeenDetection]
    strongest: float
    clock: TrackClock
    settings: TrackSettings

    @classmethod
    def of(
        cls, detections: Sequence[Detection], clock: TrackClock, settings: TrackSettings
    ) -> Self:
        """Of detections in any order."""
        seen = [SeenDetection(observe(d, settings), sign_of(d), log_content(d)) for d in detections]
        strongest = max([d.snr for d in detections if not math.isnan(d.snr)], default=0.0)
        return cls(detections, seen, strongest, clock, settings)


def expected(traces: Sequence[Trace], frame: FrameOfTouches) -> list[TrackState]:
    """Where each touch is expected."""
    settings = frame.settings
    moving = 0.0 if settings.still else min(frame.clock.passed, _PAUSE)
    return [predict(trace.state, moving, settings) for trace in traces]


def pairs_of(
    traces: Sequence[Trace], states: Sequence[TrackState], frame: FrameOfTouches
) -> Association:
    """Which detection is of which touch."""
    if not traces or not frame.seen:
        return NOTHING
    touches = [
        ExpectedTouch(state, trace.sign, trace.strength, trace.odds, len(trace.members) > 1)
        for trace, state in zip(traces, states, strict=True)
    ]
    return associate(touches, frame.seen)


def miss(
    traces: Sequence[Trace], states: Sequence[TrackState], found: Association, frame: FrameOfTouches
) -> None:
    """Of those that no detection is of: they are where they are expected."""
    paired, clock = set(found.pairs.values()), frame.clock
    if len(paired) == len(traces):
        return
    now = {t.key: t.alone(clock.now) for t in traces if t.reported}
    for number, (trace, state) in enumerate(zip(traces, states, strict=True)):
        if number in paired:
            continue
        if trace.missing is None:
            trace.missing, trace.beside, trace.met = clock.now, now, {}
        trace.state = state
        trace.odds = missed(trace.odds, trace.detection.snr, frame.settings.least_snr, clock.passed)


def see(
    traces: Sequence[Trace], states: Sequence[TrackState], found: Association, frame: FrameOfTouches
) -> None:
    """Of those that a detection is of."""
    settings, clock = frame.settings, frame.clock
    reported = sum(trace.reported for trace in traces)
    for index, number in found.pairs.items():
        trace, detection = traces[number], frame.detections[index]
        position, jumped = frame.seen[index].position, number in found.jumped
        trace.see(detection, clock.now, clock.passed, still=settings.still)
        if jumped:  # its region has changed: it has not moved
            trace.change(clock.now)
        if jumped or settings.still:
            trace.state = begin(position, settings)
        else:
            trace.state = update(states[number], position)
        strongest = frame.strongest if reported > trace.reported else 0.0
        trace.odds = confirmed(trace.odds, detection, settings.snr, strongest, clock.passed)
