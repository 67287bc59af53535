"""What a script does at a moment: forces, positions and bends between the rows of their courses,
and what is broken."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from typing import Generic, Self, TypeVar

import numpy as np

from tomoskin.core import FloatArray, GeometryError, ScriptError, located
from tomoskin.model.mesh import Arm, Hinge, Outline
from tomoskin.model.section import Section
from tomoskin.twin.bend import Bent, Deformation, Pose, Stretched
from tomoskin.twin.faults import Faults, LineSettings
from tomoskin.twin.probe import Probe, Shape
from tomoskin.twin.script_schema import BendSection, FaultSection, PressSection, StretchSection

Rows = tuple[tuple[float, ...], ...]
"""A course: time since its start, then values; straight lines between the rows."""

Friction = Mapping[str, float]
"""Coefficient of friction of a probe that slides, and of one that rolls."""

NO_FRAME = "no frame would show it: make it longer, or shorten [readout] settling of the skin"
"""What to do about a stage that is shorter than a frame."""

_ON_PATH = 200
"""A path is looked at in so many positions when it is checked to lie on the skin."""


S_co = TypeVar("S_co", bound=Section, covariant=True)


@dataclass(frozen=True)
class Scripted(Generic[S_co]):
    """A table of a script as it is ``given``, and ``where`` it stands, for messages."""

    given: S_co
    where: str


@dataclass(frozen=True)
class ScriptedPress(Scripted[PressSection]):
    """A probe with the courses of its force and position.

    Attributes
    ----------
    shape
        Face of the probe.
    force
        Rows of (s since the start, N), from 0 N to 0 N.
    path
        Rows of (s since the start, x, y in m).
    """

    shape: Shape
    force: Rows
    path: Rows

    @property
    def end(self) -> float:
        """The time when the force is gone, in s."""
        return self.given.start + self.force[-1][0]

    def at(self, time: float, friction: Friction) -> Probe | None:
        """The probe at ``time`` s, None where there is no force."""
        since = time - self.given.start
        force = float(along(self.force, since)[0])
        if not (0 <= since <= self.force[-1][0] and force > 0):
            return None
        x, y = along(self.path, since).tolist()
        probe = Probe(self.shape, x, y, force, self.given.angle)
        return probe.moving(*_speed(np.array(self.path), since), friction[self.given.motion])

    def stages(self) -> Iterator[tuple[str, float]]:
        """Key and length in s of each piece of the courses."""
        force = "profile" if self.given.profile else "hold"
        for key, rows in ((force, self.force), ("path", self.path)):
            for length in np.diff([row[0] for row in rows]).tolist():
                yield key, length

    def check_on(self, outline: Outline) -> None:
        """Raise ScriptError where the middle of the probe leaves the skin."""
        rows = [row[0] for row in self.path]
        times = np.union1d(rows, np.linspace(0.0, rows[-1], _ON_PATH if rows[1:] else 1))
        positions = np.array([along(self.path, time) for time in times])
        inside = outline.contains(positions)
        if not inside.all():
            first = int(np.argmin(inside))
            x, y = 1e3 * positions[first]
            corners = 1e3 * outline.polyline(outline.length / 64)
            (west, low), (right, high) = corners.min(axis=0), corners.max(axis=0)
            raise ScriptError(
                f"expected a position on the skin (x from {west:.0f} to {right:.0f} mm, y from "
                f"{low:.0f} to {high:.0f} mm), got ({x:.1f} mm, {y:.1f} mm), which is off the "
                "skin",
                where=f"{self.where} {'path' if times[first] else 'at'}",
                hint="the middle of a probe must be inside the outline",
            )


@dataclass(frozen=True)
class ScriptedBend(Scripted[BendSection | StretchSection]):
    """A bend or stretch with the course of its amount.

    ``course``: rows of (s since its start, rad or elongation), from 0 to 0.
    """

    course: Rows

    @classmethod
    def of(cls, given: BendSection | StretchSection, where: str) -> Self:
        """Raises ScriptError for a profile that does not end at 0, and impossible shapes."""
        most = given.strain if isinstance(given, StretchSection) else given.angle
        course = there_and_back(given, most, where)
        made = cls(given, where, course)
        with located(where, ScriptError, GeometryError):
            for _, amount in course:
                made.shape(amount)
        return made

    @property
    def end(self) -> float:
        """When the sheet is flat again, s."""
        return self.given.start + self.course[-1][0]

    def amount(self, time: float) -> float:
        """Rad or elongation at ``time`` s."""
        return float(along(self.course, time - self.given.start)[0])

    def shape(self, amount: float) -> Deformation:
        """What the sheet does at an ``amount``."""
        match self.given:
            case StretchSection(across=across, axis=axis):
                return Stretched(amount, across * amount, axis)
            case BendSection(radius=float(radius), length=length):
                return Bent(Arm(radius, amount, length))
            case BendSection(length=length, axis=axis, offset=offset):
                return Bent(Hinge(amount, length, axis, offset))

    def truth(self, time: float) -> dict[str, float | str]:
        """The truth at ``time`` s, for the file."""
        amount = self.amount(time)
        match self.given:
            case StretchSection(axis=axis):
                return {"kind": "stretch", "strain": amount, "axis": axis}
            case BendSection(kind="joint"):
                return {"kind": "joint", "angle": amount, "axis": 0.0}
            case BendSection(kind=kind, axis=axis):
                return {"kind": kind, "angle": amount, "axis": axis}


def bent(bends: Iterable[ScriptedBend], time: float) -> Pose:
    """How the sheet is bent and stretched at ``time`` s."""
    return tuple(bend.shape(bend.amount(time)) for bend in bends if bend.amount(time) != 0.0)


def bent_truth(bends: Iterable[ScriptedBend], time: float) -> list[dict[str, float | str]]:
    """The same in words, for the file."""
    return [bend.truth(time) for bend in bends if bend.amount(time) != 0.0]


def there_and_back(
    given: PressSection | BendSection | StretchSection, most: float | None, where: str
) -> Rows:
    """Course from 0 to 0: by its profile, or up to ``most``, held for a while, and down.

    Raises ScriptError for a profile that does not end at 0.
    """
    if most is not None and given.hold is not None:
        held = given.rise + given.hold
        return ((0.0, 0.0), (given.rise, most), (held, most), (held + given.fall, 0.0))
    place = f"{where} profile"
    rows = after((0.0, 0.0), given.profile, place)
    if rows[-1][1] != 0.0:
        hint = "add a row with the time at which nothing is left of it"
        raise ScriptError(
            f"expected 0 in the last row, got {rows[-1][1]:g}", where=place, hint=hint
        )
    return rows


def after(first: tuple[float, ...], rows: Rows | None, where: str) -> Rows:
    """``rows`` after the ``first`` one, which stands at time 0."""
    if rows and not rows[0][0] > 0:
        raise ScriptError("row 0: expected a time above 0 s, got 0 s", where=where)
    return (first, *(rows or ()))


def pressed(presses: Iterable[ScriptedPress], time: float, friction: Friction) -> tuple[Probe, ...]:
    """What presses on the sheet at ``time`` s."""
    return tuple(probe for press in presses if (probe := press.at(time, friction)) is not None)


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


def along(rows: Rows, time: float) -> FloatArray:
    """(n,) values of a course at ``time``; before and after it, those of its ends."""
    times, *columns = zip(*rows, strict=True)
    return np.array([np.interp(time, times, values) for values in columns])


def _speed(rows: FloatArray, time: float) -> tuple[float, float]:
    """(vx, vy) m/s on a path of (time, x, y); 0 before and after it."""
    if not rows[0, 0] <= time < rows[-1, 0]:
        return 0.0, 0.0
    row = int(np.searchsorted(rows[:, 0], time, side="right"))
    duration, dx, dy = rows[row] - rows[row - 1]
    return float(dx / duration), float(dy / duration)


@dataclass(frozen=True)
class Disturbance:
    """All that is wrong at a moment.

    ``noise`` LSB of one conversion, None where it is the twin's own; ``warmer`` K.
    """

    faults: Faults = field(default_factory=Faults)
    line: LineSettings = field(default_factory=LineSettings)
    noise: float | None = None
    warmer: float = 0.0


def disturbed(faults: Iterable[Scripted[FaultSection]], time: float) -> Disturbance:
    """What is wrong at ``time`` s; of two of a kind that set a number, the later one counts."""
    now = Disturbance()
    for fault in sorted((one.given for one in faults), key=lambda fault: fault.start):
        if fault.kind == "temperature" and fault.start <= time:
            now = replace(now, warmer=now.warmer + fault.amount)
        elif fault.start <= time < fault.stop:
            now = _with(now, fault)
    return now


def reboots(faults: Iterable[Scripted[FaultSection]], since: float, time: float) -> bool:
    """Whether the board loses its power after ``since``, up to ``time`` s."""
    return any(f.given.kind == "reboot" and since < f.given.start <= time for f in faults)


def _with(now: Disturbance, fault: FaultSection) -> Disturbance:
    pair = tuple(sorted((fault.electrode or 0, fault.other or 0)))
    wires = {
        "cut": ("cut", fault.electrode),
        "short": ("shorts", pair),
        "rail": ("railed", fault.electrode),
    }
    if fault.kind in wires:
        name, broken = wires[fault.kind]
        faults = replace(now.faults, **{name: getattr(now.faults, name) | {broken}})
        return replace(now, faults=faults)
    if fault.kind == "noise":
        return replace(now, noise=fault.amount)
    name = {"loss": "loss", "corruption": "corruption", "delay": "hold"}[fault.kind]
    return replace(now, line=replace(now.line, **{name: fault.amount}))
