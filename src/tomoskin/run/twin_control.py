"""What is done to the twin: all presses together, how it is bent, what is broken."""

from __future__ import annotations

import threading
from dataclasses import asdict
from typing import Any, Protocol, runtime_checkable

from tomoskin.mesh import Surface
from tomoskin.run.posing import SheetPose, sheet_pose
from tomoskin.run.twin_requests import SetPose, SetTwin
from tomoskin.twin import Contact, Faults, Pose, Press


@runtime_checkable
class Pressable(Protocol):
    """A source that can be pressed, as the twin can."""

    def set_presses(self, presses: tuple[Contact, ...]) -> None:
        """All presses from now on."""


@runtime_checkable
class Breakable(Protocol):
    """A source that can be broken and mended, as the twin can."""

    def set_faults(self, faults: Faults) -> None:
        """All that is broken from now on."""

    def set_noise(self, noise: float | None) -> None:
        """Standard deviation of one conversion, LSB; None: the source's own."""


@runtime_checkable
class Bendable(Protocol):
    """A source whose sheet can be bent and stretched, as the twin's can."""

    def set_pose(self, pose: Pose) -> None:
        """How it lies from now on."""


class TwinControl:
    """Does to the source of the moment what was asked, and to the next one the same.

    Presses are for one thread, faults and poses may come from any: a pose takes long.

    Attributes
    ----------
    pressable
        Whether the source can be pressed.
    truth
        The presses that the source feels.
    pose
        How its sheet is bent and stretched.
    harm
        What is wrong with it by our doing.
    """

    def __init__(self) -> None:
        """Nothing is done, and there is no source."""
        self.pressable = False
        self.truth: tuple[Contact, ...] = ()
        self.pose = SheetPose()
        self.harm = SetTwin((), None)
        self._presses: dict[object, tuple[Contact, ...]] = {}
        self._is_due = True
        self._breakable: Breakable | None = None
        self._bendable: Bendable | None = None
        self._lock = threading.Lock()

    def attach(self, source: object) -> None:
        """A source that has just been opened is to be as the one before was."""
        with self._lock:
            self.pressable = isinstance(source, Pressable)
            self._breakable = source if isinstance(source, Breakable) else None
            self._bendable = source if isinstance(source, Bendable) else None
            self._break(self.harm)
            self._bend(self.pose)

    @property
    def breakable(self) -> bool:
        """Whether the source can be broken and mended."""
        return self._breakable is not None

    @property
    def bendable(self) -> bool:
        """Whether the source has a sheet that can be bent and stretched."""
        return self._bendable is not None

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

    def hold(self, owner: object, presses: tuple[Contact, ...]) -> None:
        """All presses that ``owner`` holds now; an empty tuple lifts them."""
        self._presses.pop(owner, None)
        if presses:
            self._presses[owner] = presses
        self._is_due = True

    def press(self, source: Pressable) -> bool:
        """Let ``source`` feel what is pressed now; whether the truth has changed."""
        if not self._is_due:
            return False
        self._is_due = False
        presses = tuple(press for held in self._presses.values() for press in held)
        source.set_presses(presses)
        self.truth = presses
        return True

    def _break(self, harm: SetTwin) -> None:
        if self._breakable is not None:
            self._breakable.set_faults(Faults(cut=frozenset(harm.cut)))
            self._breakable.set_noise(harm.noise)
            self.harm = harm

    def _bend(self, pose: SheetPose) -> None:
        if self._bendable is not None:
            self._bendable.set_pose(pose.pose)
            self.pose = pose
        self._is_due = True


def described(contact: Contact) -> dict[str, Any]:
    """A press as a recording describes it: by the circle with the area of its face."""
    if isinstance(contact, Press):
        return asdict(contact)
    return {
        "x": contact.x,
        "y": contact.y,
        "force": contact.force,
        "radius": contact.radius,
        "angle": contact.angle,
        "shape": type(contact.shape).__name__.lower(),
    }
