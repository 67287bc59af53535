"""What a page may do to the twin: press it with any face, bend and stretch it, break its wires."""

from __future__ import annotations

import math
from typing import Annotated, Literal

import msgspec
import numpy as np
from msgspec import Meta

from tomoskin.core import WireError
from tomoskin.twin import FACES, Contact, Face, Grid, Press, Probe, Shape

MAX_PRESSES = 8
"""Most presses that one page may hold."""

MAX_FORCE = 10.0
"""Hardest press from a page, N."""

_NODES, _MARGIN, _LEAST = 64, 0.06, 4
"""A polygon must cover some nodes of a grid as coarse as the one that its dent is solved on."""

_Place = Annotated[float, Meta(ge=-10, le=10)]
_Turn = Annotated[float, Meta(ge=-2 * math.pi, le=2 * math.pi)]
_Corner = Annotated[float, Meta(ge=-1, le=1)]


class StrictRequest(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """What a page may send; a field that is not known is an error."""


class PressRequest(StrictRequest, frozen=True):
    """One press: place m, force N, ``radius`` half of the face's size m, turned by ``angle`` rad.

    ``vertices``: corners (x, y) m of a polygon around the probe's middle.
    """

    x: _Place
    y: _Place
    force: Annotated[float, Meta(ge=0, le=MAX_FORCE)]
    radius: Annotated[float, Meta(ge=1e-4, le=1)]
    shape: Literal["circle", "square", "finger", "polygon"] = "circle"
    angle: _Turn = 0.0
    vertices: Annotated[tuple[tuple[_Corner, _Corner], ...], Meta(max_length=24)] | None = None

    @property
    def contact(self) -> Contact:
        """What presses on the twin.

        Raises WireError where corners are missing, GeometryError where they make no polygon.
        """
        if (self.shape == "polygon") != (self.vertices is not None):
            raise WireError(
                f"expected vertices for a polygon and for no other shape, got {self.shape}"
            )
        if self.vertices is not None:
            face: Shape = _wide(Face(self.vertices))
            return Probe(face, self.x, self.y, self.force, self.angle)
        if self.shape == "circle":
            return Press(self.x, self.y, self.force, self.radius)
        face = FACES[self.shape](self.radius)
        return Probe(face, self.x, self.y, self.force, self.angle)


def _wide(face: Face) -> Face:
    """``face``; WireError where it is too slim to be pressed."""
    step = 2 * (face.extent + _MARGIN) / _NODES
    if np.count_nonzero(np.isfinite(face.gap(Grid(2 * _NODES, step).points))) < _LEAST:
        raise WireError(f"expected a polygon at least {2e3 * step:.0f} mm wide, got a narrower one")
    return face


class SetPresses(StrictRequest, frozen=True, tag="presses"):
    """All presses that this page holds now."""

    presses: Annotated[tuple[PressRequest, ...], Meta(max_length=MAX_PRESSES)]


class SetTwin(StrictRequest, frozen=True, tag="twin"):
    """All that is wrong with the twin from now on: electrodes cut, LSB of noise (null: its own)."""

    cut: Annotated[tuple[Annotated[int, Meta(ge=0, le=31)], ...], Meta(max_length=32)]
    noise: Annotated[float, Meta(ge=0, le=1000)] | None


class BendRequest(StrictRequest, frozen=True):
    """By ``angle`` rad from rest, positive where the front becomes convex; for a sheet that lies
    flat, over a strip of ``length`` m along ``axis`` (rad from x), ``offset`` m off the middle."""

    angle: _Turn
    axis: _Turn = math.pi / 2
    length: Annotated[float, Meta(ge=1e-3, le=10)] = 0.06
    offset: _Place = 0.0


class StretchRequest(StrictRequest, frozen=True):
    """Relative elongations along ``axis`` (rad from x) and across it."""

    along: Annotated[float, Meta(ge=-0.5, le=1)]
    across: Annotated[float, Meta(ge=-0.5, le=1)] = 0.0
    axis: _Turn = 0.0


class SetPose(StrictRequest, frozen=True, tag="pose"):
    """How the twin's sheet is bent and stretched from now on; null: as at rest."""

    bend: BendRequest | None = None
    stretch: StretchRequest | None = None
