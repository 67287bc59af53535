"""One flow of presses where the dot is, from its first dot to what is kept of it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from tomoskin.calibration import Calibration, Locator, WiringAnswer, write_calibration
from tomoskin.core import FloatArray, WireError, write_text
from tomoskin.pipeline import Prepared, prepare
from tomoskin.run import Runner, commands
from tomoskin.server.folder import Folder
from tomoskin.server.lessons import Dots, Lesson, Thought, touch_thought, wiring_thought
from tomoskin.server.requests import FlowKind
from tomoskin.server.taking import Taker

_LEAST = 0.5
"""Noise is never taken for less than this part of what the read-out predicts."""


class PressFlow:
    """What was pressed so far, and what it tells; lives in the event loop.

    Attributes
    ----------
    taker
        Takes the presses; belongs to a thread of its own.
    lessons
        Presses so far.
    thought, trouble
        What they tell, or why that is not known.
    thinking
        Whether something newer is being thought of.
    """

    def __init__(self, kind: FlowKind, prepared: Prepared) -> None:
        self.kind, self.prepared = kind, prepared
        self.taker = Taker(_LEAST * prepared.readout.noise)
        self.lessons: list[Lesson] = []
        self.thought: Thought | None = None
        self.trouble = ""
        self.thinking = False
        self._dots = Dots(prepared)
        self._dot = self._dots.next((), None)

    def add(self, dv: FloatArray) -> None:
        """A press on the dot made the change ``dv`` (n_meas,) V; the dot moves on."""
        self.lessons.append(Lesson(self._dot, dv))
        self._dot = self._dots.next(self.lessons, self.thought)

    def undo(self) -> None:
        """Take the last press back."""
        if not self.lessons:
            raise WireError("there is no press to take back")
        self._dot = self.lessons.pop().place
        self.thought = None

    def think(self, lessons: Sequence[Lesson]) -> Thought:
        """What these presses tell; in a thread. Raises DataError."""
        if self.kind == "touch":
            return touch_thought(self.prepared, lessons)
        return wiring_thought(self.prepared, lessons, self.taker.untouched)

    def answer(self) -> Locator | WiringAnswer:
        """What can be kept. Raises WireError where the presses do not tell enough."""
        thought = self.thought
        if self.thinking or thought is None or not thought.ready or thought.answer is None:
            raise WireError("the presses do not tell enough yet")
        return thought.answer

    def fields(self) -> dict[str, Any]:
        """What a page shows of it."""
        thought = self.thought or Thought("")
        return {
            "kind": self.kind,
            "phase": self.taker.phase,
            "dot": self._dot,
            "presses": [lesson.place for lesson in self.lessons],
            "thinking": self.thinking,
            "text": self.trouble or thought.text,
            "ready": thought.ready and not self.thinking,
            "figures": thought.figures,
        }


def keep(
    flow: PressFlow, answer: Locator | WiringAnswer, folder: Folder, name: str, runner: Runner
) -> str:
    """Save ``answer`` and have the run go on with it; in a thread. The file's name."""
    skin = flow.prepared.skin
    if isinstance(answer, Locator):
        path = folder.free(name, ".npz")
        write_calibration(path, Calibration(answer, flow.prepared.pattern, skin.name))
        runner.ask(commands.Adopt(runner.prepared.located_by(answer)))
    else:
        path = folder.free(name, ".toml")
        wired = answer.wiring.applied(skin)
        write_text(path, wired.to_toml())
        runner.ask(commands.Change(prepare(wired)))
    return path.name
