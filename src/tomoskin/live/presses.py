"""Who presses the twin: the pages' presses together, each page's own set replaced as a whole."""

from __future__ import annotations

import threading
from dataclasses import dataclass, field
from typing import Protocol, runtime_checkable

from tomoskin.twin import Faults, Press


@runtime_checkable
class Pressable(Protocol):
    """A source that can be pressed, as the twin can."""

    def set_presses(self, presses: tuple[Press, ...]) -> None:
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
        self._held: dict[object, tuple[Press, ...]] = {}
        self._lock = threading.Lock()
        self._changes = 0

    def put(self, owner: object, presses: tuple[Press, ...]) -> None:
        """All presses that ``owner`` holds now; an empty tuple lifts them."""
        with self._lock:
            self._held.pop(owner, None)
            if presses:
                self._held[owner] = presses
            self._changes += 1

    def all(self) -> tuple[int, tuple[Press, ...]]:
        """(number that grows with each change, every press)."""
        with self._lock:
            return self._changes, tuple(p for held in self._held.values() for p in held)


class Hands:
    """What is done to the source of the moment: presses by owner, and what is broken.

    Attributes
    ----------
    truth
        The presses that the source feels.
    harmed
        What is wrong with it by our doing.
    """

    def __init__(self) -> None:
        """Nothing is done."""
        self.board = PressBoard()
        self.truth: tuple[Press, ...] = ()
        self.harmed = Harm()
        self._pressed = -1
        self._broken: Breakable | None = None

    def opened(self, source: object) -> None:
        """A source that has just been opened is to be as the one before was."""
        self._pressed = -1
        self._broken = source if isinstance(source, Breakable) else None
        self.harm(self.harmed)

    @property
    def breakable(self) -> bool:
        """Whether the source can be broken and mended."""
        return self._broken is not None

    def harm(self, harm: Harm) -> None:
        """Break and mend the source, from any thread; ModelError for what it does not have."""
        if self._broken is not None:
            harm.do(self._broken)
            self.harmed = harm

    def press(self, source: Pressable) -> bool:
        """Let ``source`` feel what is pressed now; whether that is news."""
        changes, presses = self.board.all()
        if changes == self._pressed:
            return False
        source.set_presses(presses)
        self._pressed, self.truth = changes, presses
        return True
