"""Touches as a person counts them: each once, from its first frame to its last."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from tomoskin.core import Touch


@dataclass(frozen=True, slots=True)
class Span:
    """A touch from its first frame to its last, s.

    ``x``, ``y`` (m) and ``peak`` (in the image's unit) are those of the frame in which it is
    strongest, if possible one in which it is not merged with another.
    """

    id: int
    kind: str
    begin: float
    end: float
    x: float
    y: float
    peak: float


def touch_spans(frames: Iterable[tuple[float, tuple[Touch, ...]]]) -> tuple[Span, ...]:
    """The touches in (time, touches) of frames, by their beginning.

    A number that is given again, after another start, is another touch. One that is merged with
    others goes on in what stands for it.
    """
    found: dict[tuple[int, float], tuple[float, float, Touch]] = {}
    since: dict[int, float] = {}
    for time, touches in frames:
        for touch in touches:
            since[touch.id] = touch.since
            for number in touch.merged or (touch.id,):
                key = number, since.setdefault(number, touch.since)
                begin, _, best = found.get(key, (time, time, touch))
                found[key] = begin, time, max(best, touch, key=_weight)
    spans = (
        Span(number, best.kind, begin, end, r.x, r.y, r.peak)
        for (number, _), (begin, end, best) in found.items()
        for r in [best.detection]
    )
    return tuple(sorted(spans, key=lambda span: (span.begin, span.id)))


def _weight(touch: Touch) -> tuple[bool, float]:
    return not touch.merged, abs(touch.detection.peak)
