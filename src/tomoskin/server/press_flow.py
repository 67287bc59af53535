"""One flow of presses where the dot is, from its first dot to what is kept of it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from tomoskin.calibration import TOUCH, Locator, MappingAnswer
from tomoskin.core import FloatArray, WireError, write_text
from tomoskin.pipeline import Prepared, prepare
from tomoskin.run import Runner, commands
from tomoskin.server.folder import Folder
from tomoskin.server.guided_presses import (
    EFFORTS,
    Dots,
    Effort,
    Estimate,
    GuidedPress,
    Taker,
    estimate_touch,
    estimate_wiring,
)
from tomoskin.server.requests import FlowKind

_LEAST = 0.5
"""Noise is never taken for less than this part of what the read-out predicts."""


class PressFlow:
    """What was pressed so far, and what it tells; lives in the event loop.

    Attributes
    ----------
    taker
        Takes the presses; belongs to a thread of its own.
    presses
        Presses so far.
    estimate, trouble
        What they tell, or why that is not known.
    estimating
        Whether something newer is being estimated.
    """

    def __init__(self, kind: FlowKind, prepared: Prepared) -> None:
        self.kind, self.prepared = kind, prepared
        self.taker = Taker(_LEAST * prepared.readout.noise)
        self.presses: list[GuidedPress] = []
        self.estimate: Estimate | None = None
        self.trouble = ""
        self.estimating = False
        self._dots = Dots(prepared)
        self._dot = self._dots.next((), None)

    def add(self, dv: FloatArray) -> None:
        """A press on the dot made the change ``dv`` (n_meas,) V; the dot moves on."""
        self.presses.append(GuidedPress(self._dot, dv, self.effort))
        self._dot = self._dots.next(self.presses, self.estimate)

    @property
    def effort(self) -> Effort | None:
        """How to press the dot; None where that does not matter."""
        return EFFORTS[len(self.presses) % len(EFFORTS)] if self.kind == "touch" else None

    def undo(self) -> None:
        """Take the last press back."""
        if not self.presses:
            raise WireError("there is no press to undo")
        self._dot = self.presses.pop().place
        self.estimate = None

    def estimate_from(self, presses: Sequence[GuidedPress]) -> Estimate:
        """What these presses tell; in a thread. Raises DataError."""
        if self.kind == "touch":
            return estimate_touch(self.prepared, presses)
        return estimate_wiring(self.prepared, presses, self.taker.untouched)

    def answer(self) -> Locator | MappingAnswer:
        """What can be kept. Raises WireError where the presses do not tell enough."""
        estimate = self.estimate
        if self.estimating or estimate is None or not estimate.ready or estimate.answer is None:
            raise WireError("more presses are needed")
        return estimate.answer

    def fields(self) -> dict[str, Any]:
        """What a page shows of it."""
        estimate = self.estimate or Estimate("")
        return {
            "kind": self.kind,
            "phase": self.taker.phase,
            "dot": self._dot,
            "effort": self.effort,
            "presses": [press.place for press in self.presses],
            "thinking": self.estimating,
            "text": self.trouble or estimate.text,
            "ready": estimate.ready and not self.estimating,
            "figures": estimate.figures,
        }


def keep(
    flow: PressFlow, answer: Locator | MappingAnswer, folder: Folder, name: str, runner: Runner
) -> str:
    """Save ``answer`` and have the run go on with it; in a thread. The file's name."""
    skin = flow.prepared.skin
    if isinstance(answer, Locator):
        path = folder.free(name, ".npz")
        calibration = TOUCH.of(answer, flow.prepared.pattern, skin)
        calibration.write(path)
        runner.ask(commands.Adopt(runner.prepared.calibrated(calibration)))
    else:
        path = folder.free(name, ".toml")
        wired = answer.mapping.applied(skin)
        write_text(path, wired.to_toml())
        runner.ask(commands.Change(prepare(wired)))
    return path.name
