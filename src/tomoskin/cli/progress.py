"""A bar on the terminal for what takes longer than a moment."""

from __future__ import annotations

import time
from types import TracebackType
from typing import Self

_PATIENCE = 2.0
"""Seconds without a bar."""


class Bar:
    """Shows how far a long job is, on stderr, where that is a terminal; a context manager."""

    def __init__(self, title: str) -> None:
        from rich.console import Console
        from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

        console = Console(stderr=True)
        columns = (
            TextColumn("{task.description}"),
            BarColumn(),
            TextColumn("{task.percentage:>3.0f} %"),
            TimeRemainingColumn(),
        )
        self._progress = Progress(*columns, console=console, transient=True)
        self._shown = console.is_terminal
        self._task = self._progress.add_task(title, total=None)
        self._begun = time.monotonic()
        self._running = False

    def __call__(self, done: float, total: float) -> None:
        """Say that ``done`` of ``total`` is done."""
        self._progress.update(self._task, completed=done, total=total)
        late = time.monotonic() - self._begun > _PATIENCE
        if late and self._shown and not self._running:
            self._progress.start()
            self._running = True

    def __enter__(self) -> Self:
        """The bar itself."""
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """Take it away."""
        if self._running:
            self._progress.stop()
