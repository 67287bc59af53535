"""What other threads want of the runner's own: another skin or source, other settings, its end."""

from __future__ import annotations

import threading
from collections.abc import Callable
from dataclasses import dataclass, field

from tomoskin.core import SourceError, TomoskinError
from tomoskin.pipeline import Prepared
from tomoskin.source import Transport

Opener = Callable[[], Transport]
"""Opens a source; TomoskinError where it cannot be."""

_LOOK = 0.05
_ADOPTION = 1.0


@dataclass(slots=True, eq=False)
class Change:
    """Another skin or source; whoever wants it waits until it is ``done`` or there is an error."""

    prepared: Prepared
    open: Opener
    done: threading.Event = field(default_factory=threading.Event)
    error: TomoskinError | None = None

    def refused(self, error: TomoskinError) -> None:
        """It is not to be."""
        self.error = error
        self.done.set()


class Wanted:
    """What is wanted, the newest of each kind; put by any thread, taken by the runner's own."""

    def __init__(self) -> None:
        """Nothing is."""
        self._stopping = threading.Event()
        self._nudge = threading.Event()
        self._change: Change | None = None
        self._adopted: tuple[Prepared, threading.Event] | None = None

    def stop(self) -> None:
        """It is to end."""
        self._stopping.set()
        self._nudge.set()

    def change(self, prepared: Prepared, opener: Opener, alive: Callable[[], bool]) -> None:
        """Another skin or source; returns when it is there.

        Raises
        ------
        SourceError
            When it cannot be opened (or any error of its kind), something else was wanted
            meanwhile, or the runner's thread is not ``alive``.
        """
        change = Change(prepared, opener)
        before, self._change = self._change, change
        self._nudge.set()
        if before is not None:
            before.refused(SourceError("something else has been chosen meanwhile"))
        while not change.done.wait(_LOOK):
            if not alive():
                raise SourceError("it is not running")
        if change.error is not None:
            raise change.error

    def adopt(self, prepared: Prepared) -> None:
        """Other settings; returns when they are taken over, or a second later."""
        done = threading.Event()
        self._adopted = prepared, done
        done.wait(_ADOPTION)

    @property
    def stopped(self) -> bool:
        """Whether it is to end."""
        return self._stopping.is_set()

    @property
    def elsewhere(self) -> bool:
        """Whether the source of the moment is to be left: for another, or for good."""
        return self.stopped or self._change is not None

    def wait(self, seconds: float) -> bool:
        """Wait that long; True as soon as something is wanted."""
        if not self._nudge.wait(seconds):
            return False
        self._nudge.clear()
        return True

    def next_change(self) -> Change | None:
        """The skin or source that is wanted, to be done or refused by the caller."""
        change, self._change = self._change, None
        return change

    def next_settings(self) -> tuple[Prepared, threading.Event] | None:
        """The settings that are wanted, and what to set when they are taken over."""
        adopted, self._adopted = self._adopted, None
        return adopted
