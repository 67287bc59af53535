"""Long work says how far it has come, and may be stopped there by whoever watches it.

The watcher is the working thread's (a context variable): so a mesh generator need not be handed
what a page wants to see.
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


def finished(work: Generator[None, None, _T]) -> _T:
    """What work that stops at each ``yield`` returns in the end."""
    while True:
        try:
            next(work)
        except StopIteration as end:
            result: _T = end.value
            return result
