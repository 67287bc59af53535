"""What a script does at a moment: forces and places between the rows of their courses."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from tomoskin.core import FloatArray, ScriptError
from tomoskin.mesh import Outline
from tomoskin.twin.probe import Probe
from tomoskin.twin.shape import Shape

Rows = tuple[tuple[float, ...], ...]
"""A course: time since its start, then values; straight lines between the rows."""

Friction = Mapping[str, float]
"""Coefficient of friction of a probe that slides, and of one that rolls."""

NO_FRAME = "no frame would show it: make it longer, or [readout] settling of the skin shorter"
"""What to do about a stage that is shorter than a frame."""

_ON_PATH = 200
"""A path is looked at in so many places when it is checked to lie on the skin."""


@dataclass(frozen=True)
class Mark:
    """A note at a time, s; ``where`` it stands in the script."""

    at: float
    text: str
    where: str


@dataclass(frozen=True)
class ScriptedPress:
    """A probe with the courses of its force and place.

    Attributes
    ----------
    id
        Name in the script.
    shape, angle
        Face of the probe, and by how much it is turned, rad.
    motion
        "slide" or "roll" along the path.
    start
        s since the end of the lead-in.
    force
        Rows of (s since ``start``, N), from 0 N to 0 N.
    path
        Rows of (s since ``start``, x, y in m).
    force_key, where
        Key of the force and place of the press in the script, for messages.
    """

    id: str
    shape: Shape
    angle: float
    motion: str
    start: float
    force: Rows
    path: Rows
    force_key: str
    where: str

    @property
    def end(self) -> float:
        """When the force has gone, s."""
        return self.start + self.force[-1][0]

    def at(self, time: float, friction: Friction) -> Probe | None:
        """The probe at ``time`` s, None where there is no force."""
        since = time - self.start
        force = float(along(self._force, since)[0])
        if not (0 <= since <= self.force[-1][0] and force > 0):
            return None
        x, y = along(self._path, since).tolist()
        probe = Probe(self.shape, x, y, force, self.angle)
        return probe.moving(*_speed(self._path, since), friction[self.motion])

    def stages(self) -> Iterator[tuple[str, float]]:
        """Key and length in s of each piece of the courses."""
        for key, rows in ((self.force_key, self.force), ("path", self.path)):
            for length in np.diff([row[0] for row in rows]).tolist():
                yield key, length

    def check_on(self, outline: Outline) -> None:
        """Raise ScriptError where the middle of the probe leaves the skin."""
        times = np.union1d(
            self._path[:, 0], np.linspace(0.0, self.path[-1][0], _ON_PATH if self.path[1:] else 1)
        )
        places = np.array([along(self._path, time) for time in times])
        inside = outline.contains(places)
        if not inside.all():
            first = int(np.argmin(inside))
            x, y = 1e3 * places[first]
            corners = 1e3 * outline.polyline(outline.length / 64)
            (left, low), (right, high) = corners.min(axis=0), corners.max(axis=0)
            raise ScriptError(
                f"expected a place on the skin (x from {left:.0f} to {right:.0f} mm, y from "
                f"{low:.0f} to {high:.0f} mm), got ({x:.1f} mm, {y:.1f} mm), which is off the skin",
                where=f"{self.where} {'path' if times[first] else 'at'}",
                hint="the middle of a probe must stand inside the outline",
            )

    @cached_property
    def _force(self) -> FloatArray:
        return np.array(self.force)

    @cached_property
    def _path(self) -> FloatArray:
        return np.array(self.path)


def pressed(presses: Iterable[ScriptedPress], time: float, friction: Friction) -> tuple[Probe, ...]:
    """What presses on the sheet at ``time`` s."""
    return tuple(found for press in presses if (found := press.at(time, friction)) is not None)


def check_stages(presses: Iterable[ScriptedPress], frame_time: float) -> None:
    """Raise ScriptError for a stage that no frame would show."""
    for press in presses:
        for key, length in press.stages():
            if length < frame_time:
                raise ScriptError(
                    f"a stage of {1e3 * length:g} ms is shorter than a frame of this skin, "
                    f"{1e3 * frame_time:.3g} ms",
                    where=f"{press.where} {key}",
                    hint=NO_FRAME,
                )


def along(rows: FloatArray, time: float) -> FloatArray:
    """(n,) values of a course at ``time``; before and after it, those of its ends."""
    columns = rows[:, 1:].T
    return np.array([np.interp(time, rows[:, 0], values) for values in columns])


def _speed(rows: FloatArray, time: float) -> tuple[float, float]:
    """(vx, vy) m/s on a path of (time, x, y); 0 before and after it."""
    if not rows[0, 0] <= time < rows[-1, 0]:
        return 0.0, 0.0
    row = int(np.searchsorted(rows[:, 0], time, side="right"))
    duration, dx, dy = rows[row] - rows[row - 1]
    return float(dx / duration), float(dy / duration)
