"""Which detection is of which touch: the most likely assignment, and what else may be."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple, Self

from scipy.optimize import linear_sum_assignment

from tomoskin.core import Detection
from tomoskin.sensing.track import motion
from tomoskin.sensing.track.policy import APART, EXCHANGED, GATE, JUMP, STRENGTH, confirmed, missed
from tomoskin.sensing.track.position import ELSEWHERE, NOISE, TouchStrength, log_content
from tomoskin.sensing.track.trace import Alone, Trace, TrackClock, sign_of

_PARTED = 0.02
"""How far from the middle of two, along each axis, what is seen of them may be, m."""

_LIMIT = 60.0
"""More than any pair costs."""

_PAUSE = 0.5
"""Seconds without frames, in which touches move; in a longer pause they stand: nobody looked."""


class ObservedDetection(NamedTuple):
    """A detection as it is compared: ``content`` is a logarithm."""

    detection: Detection
    position: motion.TrackObservation
    sign: float
    content: float


@dataclass(frozen=True, slots=True, eq=False)
class FrameOfTouches:
    """What a finder has detected.

    Attributes
    ----------
    observed
        Detections of one frame.
    strongest
        Their largest ratio to the noise; 0 where none is known.
    clock
        The moment.
    settings
        Of the tracker.
    """

    observed: Sequence[ObservedDetection]
    strongest: float
    clock: TrackClock
    settings: motion.TrackSettings

    @classmethod
    def of(
        cls, detections: Sequence[Detection], clock: TrackClock, settings: motion.TrackSettings
    ) -> Self:
        """The frame of detections in any order."""
        observed = [
            ObservedDetection(d, motion.observe(d, settings), sign_of(d), log_content(d))
            for d in detections
        ]
        strongest = max([d.snr for d in detections if not math.isnan(d.snr)], default=0.0)
        return cls(observed, strongest, clock, settings)


@dataclass(frozen=True, slots=True)
class Association:
    """Pairs {detection: touch}; the touches that ``jumped`` with theirs to the middle of two; and
    (touch, touch, log odds) of ``exchanges`` that are not ruled out."""

    pairs: dict[int, int]
    jumped: frozenset[int]
    exchanges: tuple[tuple[int, int, float], ...]


def associate(traces: Sequence[Trace], frame: FrameOfTouches) -> Association:
    """The likeliest (Kuhn 1955), of touches where they are expected by now.

    A pair costs the logarithm of its likelihood: of position, strength and existence. Beyond the
    gate, and between signs, there are none. Where a detection is left over and a touch too, two of
    the touches may be seen as one in the middle of their contents.
    """
    settings, observed = frame.settings, frame.observed
    moving = 0.0 if settings.still else min(frame.clock.passed, _PAUSE)
    for trace in traces:
        trace.ahead = motion.predict(trace.state, moving, settings)
    if not traces or not observed:
        return Association({}, frozenset(), ())
    cost = [_costs(trace, observed) for trace in traces]
    pairs = _least(cost)
    jumped: frozenset[int] = frozenset()
    if len(pairs) < min(len(traces), len(observed)) and len(traces) > 1:
        taken, none = set(pairs.values()), [_LIMIT] * len(observed)
        jumps = [
            none if i in taken else _jumps(trace, traces, observed, set(pairs))
            for i, trace in enumerate(traces)
        ]
        more = _least(jumps)
        pairs, jumped = pairs | more, frozenset(more.values())
    return Association(pairs, jumped, tuple(_exchanges(cost, pairs)))


def follow(traces: Sequence[Trace], association: Association, frame: FrameOfTouches) -> None:
    """Let each touch go on with its detection, or where it is expected without one."""
    settings, clock = frame.settings, frame.clock
    detected = {i: frame.observed[index] for index, i in association.pairs.items()}
    reported = sum(trace.reported for trace in traces)
    now: dict[int, Alone] = {}
    if len(detected) < len(traces):
        now = {t.key: t.alone(clock.now) for t in traces if t.reported}
    for i, trace in enumerate(traces):
        if i not in detected:
            if trace.missing is None:
                trace.missing, trace.beside, trace.met = clock.now, now, {}
            trace.state, snr = trace.ahead, trace.detection.snr
            trace.odds = missed(trace.odds, snr, settings.snr, clock.passed)
            continue
        detection, position, *_ = detected[i]
        trace.take(detection, clock.now, clock.passed, still=settings.still)
        if i in association.jumped:  # its region has changed: it has not moved
            trace.change(clock.now)
        anew = settings.still or i in association.jumped
        trace.state = (
            motion.begin(position, settings) if anew else motion.update(trace.ahead, position)
        )
        strongest = frame.strongest if reported > trace.reported else 0.0
        trace.odds = confirmed(trace.odds, detection, settings.snr, strongest, clock.passed)


def _costs(trace: Trace, observed: Sequence[ObservedDetection]) -> list[float]:
    """(m,) of one touch with each detection."""
    state = trace.ahead
    if len(trace.members) > 1:
        state = state._replace(xx=state.xx + _PARTED**2, yy=state.yy + _PARTED**2)
    there = math.log1p(math.exp(-trace.odds))
    costs = []
    for _, position, sign, content in observed:
        far, area = motion.distance(state, position)
        if far > GATE or sign != trace.sign:
            costs.append(_LIMIT)
            continue
        apart = min(0.5 * _unlike(trace.strength, content), STRENGTH)
        cost = 0.5 * far + 0.5 * math.log(area / 1e-8) + apart + there
        costs.append(cost if cost <= APART else _LIMIT)
    return costs


def _jumps(
    own: Trace, traces: Sequence[Trace], observed: Sequence[ObservedDetection], taken: set[int]
) -> list[float]:
    """(m,) what it costs that a touch, the ``own``, and another one are seen together, by each
    detection that is not ``taken``."""
    others = [
        (_between(own, other), own.strength.plus(other.strength))
        for other in traces
        if other is not own and other.sign == own.sign
    ]
    costs = []
    for index, (_, position, sign, content) in enumerate(observed):
        nearest = math.inf
        if index not in taken and sign == own.sign:
            away = (
                motion.distance(middle, position)[0] + _unlike(both, min(content, both.mean))
                for middle, both in others
            )
            nearest = min(away, default=math.inf)
        # the stronger one goes on
        cost = JUMP + 0.5 * nearest - own.strength.mean / 8
        costs.append(cost if nearest <= GATE else _LIMIT)
    return costs


def _unlike(strength: TouchStrength, content: float) -> float:
    """Squared deviations of a content from that of a touch."""
    return (content - strength.mean) ** 2 / (strength.variance + NOISE**2 + ELSEWHERE**2)


def _between(one: Trace, other: Trace) -> motion.TrackState:
    """Where the middle of their contents is; its velocity is not needed."""
    share = 1 / (1 + math.exp(other.strength.mean - one.strength.mean))
    rest = 1 - share
    a, b = one.ahead, other.ahead
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
    assigned = zip(rows.tolist(), columns.tolist(), strict=True)
    return {column: row for row, column in assigned if cost[row][column] < _LIMIT}


def _exchanges(
    cost: Sequence[Sequence[float]], pairs: dict[int, int]
) -> list[tuple[int, int, float]]:
    assigned = list(pairs.items())
    open_ones = []
    for number, (a, i) in enumerate(assigned):
        for b, k in assigned[:number]:
            odds = cost[i][a] + cost[k][b] - cost[i][b] - cost[k][a]
            if odds > EXCHANGED and cost[i][b] < _LIMIT and cost[k][a] < _LIMIT:
                open_ones.append((i, k, min(odds, 0.0)))
    return open_ones
