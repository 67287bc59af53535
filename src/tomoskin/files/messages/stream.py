"""Which skin it is, and what others know it and its coordinates by."""

from __future__ import annotations

import re
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Self

import numpy as np

from tomoskin.core import FloatArray, GeometryError, PixelMap, SinkError, StrPath, clock_ahead
from tomoskin.files.messages.place import FRAME, LinkPose, Place
from tomoskin.model.mesh import Mesh, Plane, Pose, Surface, pose_numbers
from tomoskin.model.pattern import Pattern
from tomoskin.pipeline import Prepared, colour_limit

_NAMESPACE = re.compile(r"[A-Za-z]\w*(/[A-Za-z]\w*)*", re.ASCII)

NAMES = ("namespace", "frame", "parent", "at")
"""Options of a sink that can say where the skin is."""

_PIXELS = 48
"""Pixels along the longer side of an image for others: what a glance needs."""


@dataclass(frozen=True, slots=True)
class Naming:
    """What topics begin with, and the frame of coordinates of positions.

    ``frame`` is the sheet's plane, x right and y up seen from the front; of a skin on a surface
    it is that of the surface. Without a name of its own it is "skin", in another namespace
    "NAMESPACE/skin". ``mount`` is the link of a robot that it lies on, where
    that is to be published.
    """

    namespace: str = "tomoskin"
    frame: str = ""
    mount: Place | None = None

    @classmethod
    def of(cls, options: Mapping[str, str], where: str) -> Self:
        """Read the options of :data:`NAMES`, as far as they are there. Raises SinkError."""
        for key, form in (("namespace", _NAMESPACE), ("frame", FRAME), ("parent", FRAME)):
            text = options.get(key)
            if text is not None and not form.fullmatch(text):
                raise SinkError(
                    f'expected a {key} of letters, digits and "_", with "/" between names, '
                    f'got "{text}"',
                    where=where,
                    hint=f"for example {key}=left_arm",
                )
        if "at" in options and "parent" not in options:
            raise SinkError(
                "expected parent=… together with at=…, got at=… alone",
                where=where,
            )
        mount = None
        if "parent" in options:
            mount = _mount(options["parent"], options.get("at", ""), where)
        named = {key: options[key] for key in ("namespace", "frame") if key in options}
        return cls(**named, mount=mount)

    def of_skin(self, place: Place | None) -> Naming:
        """Of one of a robot's skins, below this; this itself where there is no robot.

        Positions on a link are in the link's frame, which needs no transform of its own.
        """
        if place is None:
            return self
        frame = place.link or (f"{self.frame}/{place.name}" if self.frame else "")
        return Naming(f"{self.namespace}/{place.name}", frame)

    @property
    def frame_id(self) -> str:
        """Name of the frame of coordinates."""
        default = "skin" if self.namespace == Naming().namespace else f"{self.namespace}/skin"
        return self.frame or default

    def topic(self, name: str) -> str:
        """A topic in full, without its first "/": one that begins with "/" is all robots' own."""
        return name[1:] if name.startswith("/") else f"{self.namespace}/{name}"


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
    board
        How the board is doing at this moment, by name; None where no run is going on.
    obey
        Has the run do what a listener asks for: "reference", "record" into a folder, "stop".
        Returns what was done, in words; raises TomoskinError. None where no run is going on.
    place
        Which of a robot's skins it is; None where there is no robot.
    naming
        What its topics begin with, and the frame of its positions: its own on a robot.
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
    board: Callable[[], Mapping[str, object]] | None = None
    obey: Callable[[str, Path], str] | None = None
    place: Place | None = None
    naming: Naming = field(default_factory=Naming)

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
            naming=Naming().of_skin(place),
        )

    @property
    def parent(self) -> str:
        """The link that the skin is known to lie on; "" where none is."""
        mount = self.naming.mount or self.place
        return "" if mount is None else mount.link

    def link(self, utc: float | None) -> LinkPose | None:
        """Where the link that the skin lies on was at a time, s since 1970; None of no link."""
        return None if self.place is None else self.place.at(utc)

    def named(self, naming: Naming) -> Self:
        """The same, called as ``naming`` says, and each of a robot's skins below it."""
        return replace(self, naming=naming.of_skin(self.place))

    def file(self, path: StrPath) -> Path:
        """The file of this skin: on a robot its name stands in that of the file."""
        path = Path(path)
        return path if self.place is None else path.with_stem(f"{path.stem}-{self.place.name}")

    def log_time(self, host_time: float) -> int:
        """Ns since 1970 of ``host_time``."""
        return round(1e9 * (host_time + self.epoch))

    def utc(self, host_time: float) -> float | None:
        """S since 1970 of ``host_time``; None in a simulation, which has no time of the day."""
        return round(host_time + self.epoch, 6) if self.epoch else None

    def latency(self, host_time: float) -> float | None:
        """S from ``host_time`` until now; None for what was recorded."""
        return None if self.clock is None else round(self.clock() - host_time, 6)


def row_labels(pattern: Pattern) -> list[str]:
    """``E2-E1 E4-E5``: source and sink, plus and minus of each measurement."""
    tables = np.hstack((pattern.drive, pattern.measure)) + 1
    return [f"E{a}-E{b} E{c}-E{d}" for a, b, c, d in tables.tolist()]


def raster(prepared: Prepared) -> PixelMap | None:
    """Raster for an image that is looked at; None for a curved sheet."""
    try:
        return prepared.mesh.pixels(_PIXELS)
    except GeometryError:
        return None


def epoch() -> float:
    """What is added to a host time of now to give seconds since 1970."""
    return clock_ahead(time.time)


def _mount(link: str, at: str, where: str) -> Place:
    try:
        numbers = pose_numbers(at, "m and rad")
    except ValueError as error:
        hint = "for example parent=tool0,at=0/0/0.05"
        raise SinkError(f"at: {error}", where=where, hint=hint) from None
    return Place("", link, Pose.of(numbers[:3], numbers[3:]))


def _corners(surface: Surface, mesh: Mesh) -> FloatArray | None:
    return _in_space(surface, mesh.points)[mesh.cells] if mesh.cells.shape[1] == 3 else None


def _in_space(surface: Surface, positions: FloatArray) -> FloatArray:
    """(n, 3) m of positions on the sheet, or of a body."""
    return positions if positions.shape[1] == 3 else surface.point(positions)
