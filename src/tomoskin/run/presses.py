"""What is done to the twin: the pages' presses together, how it is bent, what is broken."""

from __future__ import annotations

import threading
from dataclasses import dataclass, field
from typing import Any, Protocol, runtime_checkable

from tomoskin.run.posing import Bendable, Posed
from tomoskin.twin import Contact, Faults, Press


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


@dataclass(frozen=True, slots=True)
class Harm:
    """What is wrong with a source: ``faults``, and ``noise`` in LSB where that is not its own."""

    faults: Faults = field(default_factory=Faults)
    noise: float | None = None

    def do(self, source: Breakable) -> None:
        """Break and mend; ModelError for an electrode that is not there."""
        source.set_faults(self.faults)
        source.set_noise(self.noise)


class PressBoard:
    """Presses by owner; written by the pages, taken by the runner's thread."""

    def __init__(self) -> None:
        self._held: dict[object, tuple[Contact, ...]] = {}
        self._lock = threading.Lock()
        self._changes = 0

    def put(self, owner: object, presses: tuple[Contact, ...]) -> None:
        """All presses that ``owner`` holds now; an empty tuple lifts them."""
        with self._lock:
            self._held.pop(owner, None)
            if presses:
                self._held[owner] = presses
            self._changes += 1

    def renew(self) -> None:
        """Something else has changed that goes with the presses."""
        with self._lock:
            self._changes += 1

    def all(self) -> tuple[int, tuple[Contact, ...]]:
        """(number that grows with each change, every press)."""
        with self._lock:
            return self._changes, tuple(p for held in self._held.values() for p in held)


class Hands:
    """What is done to the source of the moment: presses by owner, bends, and what is broken.

    Attributes
    ----------
    truth
        The presses that the source feels.
    posed
        How its sheet is bent and stretched.
    harmed
        What is wrong with it by our doing.
    """

    def __init__(self) -> None:
        """Nothing is done."""
        self.board = PressBoard()
        self.truth: tuple[Contact, ...] = ()
        self.posed = Posed()
        self.harmed = Harm()
        self._pressed = -1
        self._broken: Breakable | None = None
        self._bent: Bendable | None = None

    def opened(self, source: object) -> None:
        """A source that has just been opened is to be as the one before was."""
        self._pressed = -1
        self._broken = source if isinstance(source, Breakable) else None
        self._bent = source if isinstance(source, Bendable) else None
        self.harm(self.harmed)
        self.bend(self.posed)

    @property
    def breakable(self) -> bool:
        """Whether the source can be broken and mended."""
        return self._broken is not None

    def harm(self, harm: Harm) -> None:
        """Break and mend the source, from any thread; ModelError for what it does not have."""
        if self._broken is not None:
            harm.do(self._broken)
            self.harmed = harm

    @property
    def bendable(self) -> bool:
        """Whether the source has a sheet that can be bent and stretched."""
        return self._bent is not None

    def bend(self, posed: Posed) -> None:
        """Bend and stretch the source, from any thread; GeometryError for what it cannot be."""
        if self._bent is not None:
            self._bent.set_pose(posed.pose)
            self.posed = posed
            self.board.renew()

    def press(self, source: Pressable) -> bool:
        """Let ``source`` feel what is pressed now; whether the truth has changed."""
        changes, presses = self.board.all()
        if changes == self._pressed:
            return False
        source.set_presses(presses)
        self._pressed, self.truth = changes, presses
        return True


def described(contact: Contact) -> Any:
    """A press as a recording tells it: by the circle with the area of its face, and as it is."""
    if isinstance(contact, Press):
        return contact
    return {
        "x": contact.x,
        "y": contact.y,
        "force": contact.force,
        "radius": contact.radius,
        "angle": contact.angle,
        "shape": type(contact.shape).__name__.lower(),
    }
