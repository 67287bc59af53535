"""A bar on the terminal for what takes longer than a moment."""

from __future__ import annotations

import threading
import time
from types import TracebackType
from typing import Self

_PATIENCE = 2.0
"""Seconds without a bar."""


class Bar:
    """Shows how far a long job is, on stderr, where that is a terminal; a context manager.

    A job that cannot say how far it is need not: the bar then only shows that it goes on.
    """

    def __init__(self, title: str) -> None:
        from rich.console import Console
        from rich.progress import (
            BarColumn,
            Progress,
            TaskProgressColumn,
            TextColumn,
            TimeRemainingColumn,
        )

        console = Console(stderr=True)
        columns = (
            TextColumn("{task.description}"),
            BarColumn(),
            TaskProgressColumn("{task.percentage:>3.0f} %", text_format_no_percentage=""),
            TimeRemainingColumn(),
        )
        self._progress = Progress(*columns, console=console, transient=True)
        self._shown = console.is_terminal
        self._task = self._progress.add_task(title, total=None)
        self._begun = time.monotonic()
        self._lock = threading.Lock()
        self._running = self._over = False
        self._timer = threading.Timer(_PATIENCE, self._show)
        self._timer.daemon = True

    def __call__(self, done: float, total: float) -> None:
        """Say that ``done`` of ``total`` is done."""
        self._progress.update(self._task, completed=done, total=total)
        if time.monotonic() - self._begun > _PATIENCE:
            self._show()

    def _show(self) -> None:
        with self._lock:
            if self._shown and not self._running and not self._over:
                self._progress.start()
                self._running = True

    def __enter__(self) -> Self:
        """The bar itself."""
        if self._shown:
            self._timer.start()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """Take it away."""
        self._timer.cancel()
        with self._lock:
            self._over = True
            if self._running:
                self._progress.stop()
