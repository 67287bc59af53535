"""What leaves the pipeline while it runs: results as sinks take them, and a raster for images."""

from __future__ import annotations

import time

from tomoskin.core import GeometryError, PixelMap
from tomoskin.pipeline import Prepared, Result
from tomoskin.run.events import told
from tomoskin.sink import Moment, Stream

_PIXELS = 48
"""Pixels along the longer side of a published image: what a glance needs."""


def stream_of(prepared: Prepared, source: str) -> Stream:
    """Description for the sinks of a run that begins now."""
    return Stream(
        skin=prepared.skin.name,
        source=source,
        pattern=prepared.pattern,
        pixels=glance(prepared),
        epoch=epoch(),
    )


def moment_of(result: Result) -> Moment:
    """One frame's results as sinks take them."""
    return Moment(
        sequence=result.sequence,
        host_time=result.host_time,
        ready=result.ready,
        voltages=result.voltages,
        reference=result.reference,
        touches=result.touches,
        image=result.image if result.ready and result.pictured else None,
        happened=result.events,
        told=tuple(map(told, result.events)),
    )


def glance(prepared: Prepared) -> PixelMap | None:
    """Raster for an image that is looked at; None for a curved sheet."""
    try:
        return prepared.mesh.pixels(_PIXELS)
    except GeometryError:
        return None


def epoch() -> float:
    """What is added to a host time of now to give seconds since 1970."""
    return time.time() - time.monotonic()
