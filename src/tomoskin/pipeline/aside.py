"""Work for frames to come that is too long for pieces between two frames: a thread does it."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Future
from threading import Thread
from typing import Generic, TypeVar

_T = TypeVar("_T")

MOST_MEASUREMENTS = 400
"""Up to so many, work comes in pieces of a millisecond or two between frames. Matrices of more are
factorised in a tenth of a second, and no piece of that is less."""

_SECONDS = 8e-9
"""From the beginning to the frame that has the result, times the cube of the measurements: three
times what it takes on one core of 2020."""


class Aside(Generic[_T]):
    """Work that a thread does while frames flow.

    Its result counts from a frame on, not from a moment, so that a replay says the same. Where it
    is not ready then, that frame waits for it.

    Parameters
    ----------
    work
        What is done; it changes nothing that a frame reads.
    frames
        After so many its result counts.
    """

    def __init__(self, work: Callable[[], _T], frames: int) -> None:
        self._left, self._future = frames, Future[_T]()
        Thread(target=self._run, args=(work,), daemon=True, name="for frames to come").start()

    def _run(self, work: Callable[[], _T]) -> None:
        try:
            self._future.set_result(work())
        except BaseException as error:
            self._future.set_exception(error)

    def is_due(self) -> bool:
        """Whether the next frame has its result; asked once a frame."""
        self._left -= 1
        return self._left <= 0

    def result(self) -> _T:
        """What the work has come to; it raises what that has raised."""
        return self._future.result()


def frames_aside(n_meas: int, interval: float) -> int:
    """Frames, of so many measurements and each ``interval`` s after the other, from the beginning
    of work to its result; 0 where it comes in pieces."""
    if n_meas <= MOST_MEASUREMENTS or not interval > 0:
        return 0
    return max(1, round(_SECONDS * n_meas**3 / interval))
