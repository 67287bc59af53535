"""What a sink is, and what it is given."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Protocol, Self

from tomoskin.core import Event, FloatArray, GeometryError, Image, PixelMap, Touch, clock_ahead
from tomoskin.files.session import event_of
from tomoskin.model.mesh import Mesh, Plane, Surface
from tomoskin.model.pattern import Pattern
from tomoskin.model.robot import Place
from tomoskin.pipeline import FrameResult, Prepared, colour_limit
from tomoskin.sensing.track import TouchEvent

NO_REFERENCE = "the reference has not been taken yet: do not touch the skin for a moment"

HEARTBEAT = 1.0
"""Seconds, by host time, after which touches are sent though nothing has changed."""

_PIXELS = 48
"""Pixels along the longer side of an image for others: what a glance needs."""


@dataclass(frozen=True, slots=True, eq=False)
class Stream:
    """What will be published: given once, before it begins.

    Attributes
    ----------
    skin, source
        Name of the skin (on a robot the one that it has there), and the source in words.
    pattern
        What the voltages are rows of.
    pixels
        A raster for images; None where the skin has none (a curved sheet).
    epoch
        What is added to a host time to give seconds since 1970.
    surface
        What the sheet lies on, in the coordinates of its link where it is on one.
    replayed
        Whether frames have the times of a recording, and ``epoch`` is theirs.
    points
        (n_cells, 3) m, the middle of each cell in space; None where it is not asked for.
    corners
        (n_cells, 3, 3) m, those of each triangle in space; None where cells are tetrahedra.
    limit
        End of the symmetric scale of colours, in the image's unit.
    clock
        What host times are times of; None where they are those of a recording.
    place
        Which of a robot's skins it is; None where there is no robot.
    """

    skin: str
    source: str
    pattern: Pattern
    pixels: PixelMap | None
    epoch: float
    surface: Surface = field(default_factory=Plane)
    replayed: bool = False
    points: FloatArray | None = None
    corners: FloatArray | None = None
    limit: float = 1.0
    clock: Callable[[], float] | None = None
    place: Place | None = None

    @classmethod
    def of(
        cls,
        prepared: Prepared,
        source: str,
        recorded: float | None = None,
        place: Place | None = None,
    ) -> Self:
        """Of a run that begins now; ``source`` in words; ``recorded``: the epoch of a replay."""
        own = prepared.skin.surface
        surface = own if place is None else place.moved(own)
        return cls(
            skin=prepared.skin.name if place is None else place.name,
            source=source,
            pattern=prepared.pattern,
            pixels=raster(prepared),
            epoch=epoch() if recorded is None else recorded,
            surface=surface,
            replayed=recorded is not None,
            points=_in_space(surface, prepared.mesh.centroids),
            corners=_corners(surface, prepared.mesh),
            limit=colour_limit(prepared),
            clock=time.monotonic if recorded is None else None,
            place=place,
        )

    def log_time(self, host_time: float) -> int:
        """Ns since 1970 of ``host_time``."""
        return round(1e9 * (host_time + self.epoch))

    def utc(self, host_time: float) -> float | None:
        """S since 1970 of ``host_time``; None in a simulation, which has no time of the day."""
        return round(host_time + self.epoch, 6) if self.epoch else None

    def latency(self, host_time: float) -> float | None:
        """S from ``host_time`` until now; None for what was recorded."""
        return None if self.clock is None else round(self.clock() - host_time, 6)


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
    messages
        The same in words.
    valid
        Whether a reference stands and enough electrodes work, so that no touch means none.
    problem
        What is wrong, in a sentence, or None.
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
    messages: tuple[Event, ...] = ()
    valid: bool = True
    problem: str | None = None

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
            messages=tuple(map(event_of, result.events)),
            valid=result.ready and result.has_image,
            problem=result.problem if result.ready else NO_REFERENCE,
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

    A touch that begins or ends is sent at once, and so is whether touches are valid; what they do
    meanwhile every ``period`` s. Of frames without touches one a second is sent: who listens can
    tell a skin that nothing touches from one that is silent.
    """

    period: float = 0.0
    _state: tuple[object, ...] = ()
    _last: float = float("-inf")

    def is_due(self, moment: Moment) -> bool:
        """Whether to send the touches of ``moment``; it counts as sent if so."""
        state = (moment.valid, *(touch.id for touch in moment.touches))
        waited = moment.host_time - self._last
        period = self.period if moment.touches else HEARTBEAT
        if state == self._state and 0 <= waited < period:
            return False
        self._state, self._last = state, moment.host_time
        return True


def raster(prepared: Prepared) -> PixelMap | None:
    """Raster for an image that is looked at; None for a curved sheet."""
    try:
        return prepared.mesh.pixels(_PIXELS)
    except GeometryError:
        return None


def _corners(surface: Surface, mesh: Mesh) -> FloatArray | None:
    return _in_space(surface, mesh.points)[mesh.cells] if mesh.cells.shape[1] == 3 else None


def _in_space(surface: Surface, positions: FloatArray) -> FloatArray:
    """(n, 3) m of positions on the sheet, or of a body."""
    return positions if positions.shape[1] == 3 else surface.point(positions)


def epoch() -> float:
    """What is added to a host time of now to give seconds since 1970."""
    return clock_ahead(time.time)
