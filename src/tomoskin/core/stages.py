"""Work says how far it has come to whoever watches it, and shows what it has made on the way.

A watcher of stages may stop long work there. An observer of steps sees the records of a frame as
the steps of the flow make them, which changes nothing. Both are the working thread's (context
variables): so a mesh generator need not be handed what a page wants to see.
"""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from typing import TypeVar

_T = TypeVar("_T")

Watcher = Callable[[str], None]
"""Told of each stage that is reached; ``""``: the same goes on. What it raises ends the work."""

_watcher: ContextVar[Watcher | None] = ContextVar("watcher", default=None)


@contextmanager
def watch_stages(watcher: Watcher) -> Iterator[None]:
    """While the block lasts, what it does tells ``watcher`` how far it is."""
    before = _watcher.set(watcher)
    try:
        yield
    finally:
        _watcher.reset(before)


def reach(stage: str = "") -> None:
    """Say that the work has come to ``stage``, or goes on."""
    if (watcher := _watcher.get()) is not None:
        watcher(stage)


Observer = Callable[[str, object], None]
"""Called with what a step of the flow has made, and what that is: "voltages", "detections"."""

_observer: ContextVar[Observer | None] = ContextVar("observer", default=None)


@contextmanager
def observe_steps(observer: Observer) -> Iterator[None]:
    """While the block lasts, steps of this thread show their records to ``observer``."""
    before = _observer.set(observer)
    try:
        yield
    finally:
        _observer.reset(before)


def show(step: str, record: object) -> None:
    """Show what a ``step`` has made; where making it takes work, pass a function that does."""
    if (observer := _observer.get()) is not None:
        observer(step, record() if callable(record) else record)


def finished(work: Generator[None, None, _T]) -> _T:
    """What work that stops at each ``yield`` returns in the end."""
    while True:
        try:
            next(work)
        except StopIteration as end:
            result: _T = end.value
            return result
