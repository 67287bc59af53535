"""What all flows have in which someone presses the skin and the page says what that tells."""

from __future__ import annotations

import threading
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

from tomoskin.core import FloatArray, TomoskinError, watch_stages
from tomoskin.learning import Calibration
from tomoskin.pipeline import FrameResult, Prepared
from tomoskin.run import Runner, commands
from tomoskin.server.folder import Folder
from tomoskin.server.requests import FlowKind


@dataclass(frozen=True, eq=False)
class Estimate:
    """What presses tell so far.

    ``text`` in words; ``place`` (2,) m where a further press tells most, None where that is not
    known; ``ready``: it can be kept; ``figures`` for a page; ``answer`` what is kept.
    """

    text: str
    place: FloatArray | None = None
    ready: bool = False
    figures: dict[str, Any] = field(default_factory=dict)
    answer: Any = None


class StoppedError(TomoskinError):
    """Nobody waits for the answer any more."""


class GuidedFlow(ABC):
    """One flow; lives in the event loop, but for :meth:`see` and :meth:`estimate_from`.

    Attributes
    ----------
    kind, prepared
        What it is for, and the skin.
    estimate, trouble
        What the presses tell, or why that is not known.
    estimating, stage
        Whether something newer is being estimated, and how far that is, in words.
    answers
        What a page may ask of it, by the type of the request: called with the request, it says
        whether there is something to estimate. WireError refuses.
    """

    def __init__(self, kind: FlowKind, prepared: Prepared) -> None:
        self.kind, self.prepared = kind, prepared
        self.estimate: Estimate | None = None
        self.trouble = self.stage = ""
        self.estimating = False
        self.answers: Mapping[type, Callable[[Any], bool]] = {}
        self._stopped = threading.Event()

    @abstractmethod
    def see(self, result: FrameResult) -> object | None:
        """Look at a frame, in a thread of its own; what :meth:`take` is to be given, if any."""

    @abstractmethod
    def take(self, seen: Any) -> bool:
        """Take what was seen; whether there is something to estimate."""

    @abstractmethod
    def examples(self) -> tuple[Any, ...]:
        """What an estimate rests on now."""

    @abstractmethod
    def estimate_from(self, examples: tuple[Any, ...]) -> Estimate:
        """What these tell; in a thread. Raises TomoskinError."""

    @abstractmethod
    def details(self) -> dict[str, Any]:
        """What a page shows of it, beside what all flows show."""

    @abstractmethod
    def keep(self, answer: Any, folder: Folder, name: str, runner: Runner) -> str:
        """Save ``answer`` and have the run go on with it; in a thread. The file's name."""

    def stop(self) -> None:
        """End what is being estimated, soon."""
        self._stopped.set()

    def estimated(self, examples: tuple[Any, ...]) -> Estimate:
        """:meth:`estimate_from`, which :meth:`stop` may end with a StoppedError."""
        self._stopped.clear()

        def reached(_stage: str) -> None:
            if self._stopped.is_set():
                raise StoppedError("stopped")

        with watch_stages(reached):
            return self.estimate_from(examples)

    def fields(self) -> dict[str, Any]:
        """What a page shows of the flow."""
        estimate = self.estimate or Estimate("")
        return {
            "kind": self.kind,
            "thinking": self.estimating,
            "text": self.trouble or estimate.text,
            "ready": estimate.ready and not self.estimating,
            "figures": estimate.figures,
            **self.details(),
        }


def keep_calibration(
    calibration: Calibration[Any], folder: Folder, name: str, runner: Runner
) -> str:
    """Save ``calibration`` and have the run use it, as :meth:`GuidedFlow.keep`; the file's name."""
    path = folder.free(name, ".npz")
    calibration.write(path)
    runner.ask(commands.Adopt(runner.prepared.calibrated(calibration)))
    return path.name
