"""What a sink is, and what it is given."""

from __future__ import annotations

import time
from dataclasses import dataclass, field
from typing import Protocol, Self

from tomoskin.core import Event, FloatArray, GeometryError, Image, PixelMap, Touch
from tomoskin.mesh import Plane, Surface
from tomoskin.pattern import Pattern
from tomoskin.pipeline import FrameResult, Prepared
from tomoskin.recording import event_of
from tomoskin.touch import TouchEvent

_PIXELS = 48
"""Pixels along the longer side of an image for others: what a glance needs."""


@dataclass(frozen=True, slots=True, eq=False)
class Stream:
    """What will be published: given once, before it begins.

    Attributes
    ----------
    skin, source
        Name of the skin, and the source in words.
    pattern
        What the voltages are rows of.
    pixels
        A raster for images; None where the skin has none (a curved sheet).
    epoch
        What is added to a host time to give seconds since 1970.
    surface
        What the sheet lies on.
    replayed
        Whether frames have the times of a recording, and ``epoch`` is theirs.
    """

    skin: str
    source: str
    pattern: Pattern
    pixels: PixelMap | None
    epoch: float
    surface: Surface = field(default_factory=Plane)
    replayed: bool = False

    @classmethod
    def of(cls, prepared: Prepared, source: str, recorded: float | None = None) -> Self:
        """Of a run that begins now; ``source`` in words; ``recorded``: the epoch of a replay."""
        return cls(
            skin=prepared.skin.name,
            source=source,
            pattern=prepared.pattern,
            pixels=raster(prepared),
            epoch=epoch() if recorded is None else recorded,
            surface=prepared.skin.surface,
            replayed=recorded is not None,
        )

    def log_time(self, host_time: float) -> int:
        """Ns since 1970 of ``host_time``."""
        return round(1e9 * (host_time + self.epoch))


@dataclass(frozen=True, slots=True, eq=False)
class Moment:
    """One frame, all the way to touches.

    Attributes
    ----------
    sequence, host_time
        As in the frame that it was made from.
    ready
        Whether a reference stands; until then there are neither touches nor an image.
    voltages, reference
        (n_meas,) V.
    touches
        Tracked touches.
    happened
        What happened to touches in this frame: onset, move, release, merge, split.
    told
        The same in words.
    image
        Change of conductivity; None where a newer frame waits, or one was sent a moment ago.
    """

    sequence: int
    host_time: float
    ready: bool
    voltages: FloatArray
    reference: FloatArray
    touches: tuple[Touch, ...]
    image: Image | None
    happened: tuple[TouchEvent, ...] = ()
    told: tuple[Event, ...] = ()

    @classmethod
    def of(cls, result: FrameResult, *, with_image: bool) -> Self:
        """What sinks take of ``result``."""
        return cls(
            sequence=result.sequence,
            host_time=result.host_time,
            ready=result.ready,
            voltages=result.voltages,
            reference=result.reference,
            touches=result.touches,
            image=result.image if with_image else None,
            happened=result.events,
            told=tuple(map(event_of, result.events)),
        )


Item = Moment | Event


class Sink(Protocol):
    """Takes results elsewhere; all calls come from one thread of its own, which they may hold up.

    Any exception means that the sink is away: it is closed, and opened again after a pause.
    """

    @property
    def name(self) -> str:
        """What a person calls it; without passwords."""

    def open(self, stream: Stream) -> None:
        """Get ready to publish; again after :meth:`close`."""

    def publish(self, item: Item) -> None:
        """Send one frame's results, or an event."""

    def close(self) -> None:
        """Let go of everything; also after an :meth:`open` that failed half-way."""


@dataclass
class TouchPace:
    """Which frames' touches are worth sending.

    A touch that begins or ends is sent at once, what it does meanwhile every ``period`` s.
    Frames without touches are sent only after some, once: then the last touch has ended.
    """

    period: float = 0.0
    _ids: tuple[int, ...] = ()
    _last: float = float("-inf")

    def is_due(self, moment: Moment) -> bool:
        """Whether to send the touches of ``moment``; it counts as sent if so."""
        ids = tuple(touch.id for touch in moment.touches)
        if ids == self._ids:
            waited = moment.host_time - self._last
            if not ids or 0 <= waited < self.period:
                return False
        self._ids, self._last = ids, moment.host_time
        return True


def raster(prepared: Prepared) -> PixelMap | None:
    """Raster for an image that is looked at; None for a curved sheet."""
    try:
        return prepared.mesh.pixels(_PIXELS)
    except GeometryError:
        return None


def epoch() -> float:
    """What is added to a host time of now to give seconds since 1970."""
    return time.time() - time.monotonic()
