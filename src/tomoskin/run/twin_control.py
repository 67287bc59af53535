"""What is done to the twin from outside: presses, poses, faults."""

from __future__ import annotations

import contextlib
import threading
from dataclasses import dataclass, field
from typing import Any

from tomoskin.core import TomoskinError, WireError
from tomoskin.model.mesh import Arm, Hinge, Plane, Surface
from tomoskin.run.commands import BendRequest, SetPose, SetTwin
from tomoskin.twin import Bent, Faults, Pose, Press, Probe, Stretched


@dataclass(frozen=True, slots=True)
class SheetPose:
    """A deformed sheet: its ``pose``, what was ``asked``, and the ``truth`` for a recording."""

    pose: Pose = ()
    asked: SetPose = field(default_factory=SetPose)
    truth: tuple[dict[str, Any], ...] = ()


def way_to_bend(rest: Surface) -> str | None:
    """How a sheet that lies on ``rest`` can be bent: "hinge", "joint", or not at all."""
    if isinstance(rest, Plane):
        return "hinge"
    return "joint" if isinstance(rest, Arm) else None


def sheet_pose(asked: SetPose, rest: Surface) -> SheetPose:
    """The deformation of a sheet that lies on ``rest``.

    Raises
    ------
    WireError
        Where such a sheet cannot be bent.
    GeometryError
        Where it cannot take that shape.
    """
    pose: Pose = ()
    truth: list[dict[str, Any]] = []
    if (bend := asked.bend) is not None:
        kind = way_to_bend(rest)
        pose += (Bent(_surface(bend, rest)),)
        axis = bend.axis if kind == "hinge" else 0.0
        truth.append({"kind": kind, "angle": bend.angle, "axis": axis})
    if (stretch := asked.stretch) is not None:
        pose += (Stretched(stretch.along, stretch.across, stretch.axis),)
        truth.append({"kind": "stretch", "strain": stretch.along, "axis": stretch.axis})
    return SheetPose(pose, asked, tuple(truth))


def _surface(bend: BendRequest, rest: Surface) -> Surface:
    if isinstance(rest, Plane):
        return Hinge(bend.angle, bend.length, bend.axis, bend.offset)
    if isinstance(rest, Arm):
        return Arm(rest.radius, rest.angle + bend.angle, rest.joint)
    raise WireError(
        "only a flat sheet, or one on a limb with a joint, can be bent on the page; this one can "
        "be stretched"
    )


class TwinControl:
    """Does to the source of the moment what was asked, and to the next one the same.

    A source can be pressed, broken and bent as far as it has the twin's methods: ``set_presses``,
    ``set_faults`` with ``set_noise``, ``set_pose``.

    Presses are for one thread, faults and poses may come from any: a pose takes long.

    Attributes
    ----------
    truth
        The presses that the source feels.
    refusals
        Why it does not feel the others.
    pose
        How its sheet is bent and stretched.
    harm
        What is wrong with it by our doing.
    """

    def __init__(self) -> None:
        """Nothing is done, and there is no source."""
        self.truth: tuple[Probe, ...] = ()
        self.refusals: tuple[str, ...] = ()
        self.pose = SheetPose()
        self.harm = SetTwin((), None)
        self._presses: dict[object, tuple[Probe, ...]] = {}
        self._is_due = True
        self._source: Any = None
        self._lock = threading.Lock()

    def attach(self, source: object) -> None:
        """A source that has just been opened is to be as the one before was."""
        with self._lock:
            self._source = source
            self._break(self.harm)
            self._bend(self.pose)

    @property
    def pressable(self) -> bool:
        """Whether the source can be pressed."""
        return self._can("set_presses")

    @property
    def breakable(self) -> bool:
        """Whether the source can be broken and mended."""
        return self._can("set_faults", "set_noise")

    @property
    def bendable(self) -> bool:
        """Whether the source has a sheet that can be bent and stretched."""
        return self._can("set_pose")

    def set_harm(self, harm: SetTwin) -> None:
        """Break and mend the source; ModelError for what it does not have."""
        with self._lock:
            self._break(harm)

    def set_pose(self, asked: SetPose, rest: Surface) -> None:
        """Bend and stretch the source, whose sheet lies on ``rest``.

        Raises WireError where it cannot be bent at all, GeometryError for what it cannot be.
        """
        pose = sheet_pose(asked, rest)
        with self._lock:
            self._bend(pose)

    def hold(self, owner: object, presses: tuple[Probe, ...]) -> None:
        """All presses that ``owner`` holds now; an empty tuple lifts them."""
        self._presses.pop(owner, None)
        if presses:
            self._presses[owner] = presses
        self._is_due = True

    def press(self) -> bool:
        """Let the source feel what is pressed now; whether the truth has changed."""
        if not (self._is_due and self.pressable):
            return False
        self._is_due = False
        asked = tuple(press for held in self._presses.values() for press in held)
        self.truth, self.refusals = _felt(self._source, asked)
        return True

    @property
    def depth(self) -> float | None:
        """M by which the source's sheet gives way under its only press; None for any other."""
        sheet = getattr(self._source, "sheet", None)
        return sheet.depth_under(*self.truth) if sheet and len(self.truth) == 1 else None

    def _can(self, *methods: str) -> bool:
        return all(getattr(self._source, name, None) is not None for name in methods)

    def _break(self, harm: SetTwin) -> None:
        if self.breakable:
            self._source.set_faults(Faults(cut=frozenset(harm.cut)))
            self._source.set_noise(harm.noise)
            self.harm = harm

    def _bend(self, pose: SheetPose) -> None:
        if self.bendable:
            self._source.set_pose(pose.pose)
            self.pose = pose
        self._is_due = True


def _felt(source: Any, presses: tuple[Probe, ...]) -> tuple[tuple[Probe, ...], tuple[str, ...]]:
    """Those of ``presses`` that ``source`` takes, and why it does not take the others."""
    with contextlib.suppress(Exception):  # which of them it was is found below
        source.set_presses(presses)
        return presses, ()
    felt: tuple[Probe, ...] = ()
    refusals = []
    for press in presses:
        try:
            source.set_presses((*felt, press))
            felt = (*felt, press)
        except Exception as error:  # whatever it is, the source goes on
            names = isinstance(error, TomoskinError)
            refusals.append(str(error) if names else f"{type(error).__name__}: {error}")
    source.set_presses(felt)
    return felt, tuple(refusals)


def described(probe: Probe) -> dict[str, Any]:
    """A press as a recording describes it: by the circle with the area of its face."""
    circle = {"x": probe.x, "y": probe.y, "force": probe.force, "radius": probe.radius}
    if isinstance(probe, Press):
        return circle
    return circle | {"angle": probe.angle, "shape": type(probe.shape).__name__.lower()}
