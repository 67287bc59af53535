"""The flows of presses where the dot is: touch is learnt, or the channel mapping found."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from tomoskin.core import FloatArray, WireError, write_text
from tomoskin.learning import TOUCH, Locator, MappingAnswer
from tomoskin.pipeline import FrameResult, Prepared, prepare
from tomoskin.run import Runner, commands
from tomoskin.server.folder import Folder
from tomoskin.server.guided_flow import Estimate, GuidedFlow, keep_calibration
from tomoskin.server.guided_presses import (
    EFFORTS,
    Dots,
    Effort,
    GuidedPress,
    estimate_touch,
    estimate_wiring,
)
from tomoskin.server.press_taker import Phase, PressTaker
from tomoskin.server.requests import FlowKind, UndoPress


@dataclass(frozen=True, eq=False)
class _Seen:
    """The phase, what is wrong, and the change (n_meas,) V of a press that was taken, or None."""

    phase: Phase
    hint: str
    dv: FloatArray | None


class PressFlow(GuidedFlow):
    """What was pressed so far; see :class:`GuidedFlow`.

    Attributes
    ----------
    presses
        Presses so far.
    """

    def __init__(self, kind: FlowKind, prepared: Prepared) -> None:
        super().__init__(kind, prepared)
        self.presses: list[GuidedPress] = []
        self.answers = {UndoPress: lambda _: self._undo()}
        self._taker = PressTaker.of(prepared)
        self._now = _Seen(self._taker.phase, "", None)
        self._undone = False
        self._dots = Dots(prepared)
        self._dot = self._dots.next((), None)

    def see(self, result: FrameResult) -> _Seen | None:
        """See :class:`GuidedFlow`."""
        taker, before = self._taker, (self._taker.phase, self._taker.hint)
        if self._undone and taker.phase == "release":  # it may have been no press
            taker.restart()
        self._undone = False
        dv = taker.push(result.host_time, result.voltages)
        changed = dv is not None or before != (taker.phase, taker.hint)
        return _Seen(taker.phase, taker.hint, dv) if changed else None

    def take(self, seen: _Seen) -> bool:
        """A press on the dot was taken, and the dot moves on; or something else is to be done."""
        self._now = seen
        if seen.dv is None:
            return False
        self.presses.append(GuidedPress(self._dot, seen.dv, self.effort))
        self._dot = self._dots.next([p.place for p in self.presses], self.estimate)
        return True

    @property
    def effort(self) -> Effort | None:
        """How to press the dot; None where that does not matter."""
        return EFFORTS[len(self.presses) % len(EFFORTS)] if self.kind == "touch" else None

    def _undo(self) -> bool:
        """Remove the last press."""
        if not self.presses:
            raise WireError("there is no press to undo")
        self._dot = self.presses.pop().place
        self.estimate, self._undone = None, True
        return True

    def examples(self) -> tuple[GuidedPress, ...]:
        """See :class:`GuidedFlow`."""
        return tuple(self.presses)

    def estimate_from(self, examples: tuple[GuidedPress, ...]) -> Estimate:
        """See :class:`GuidedFlow`."""
        if self.kind == "touch":
            return estimate_touch(self.prepared, examples)
        return estimate_wiring(self.prepared, examples, self._taker.untouched)

    def details(self) -> dict[str, Any]:
        """See :class:`GuidedFlow`."""
        hint = {"text": self._now.hint} if self._now.hint else {}
        return {
            **hint,
            "phase": self._now.phase,
            "dot": self._dot,
            "effort": self.effort,
            "presses": [press.place for press in self.presses],
        }

    def keep(
        self, answer: Locator | MappingAnswer, folder: Folder, name: str, runner: Runner
    ) -> str:
        """See :class:`GuidedFlow`."""
        skin = self.prepared.skin
        if isinstance(answer, Locator):
            calibration = TOUCH.of(answer, self.prepared.pattern, skin)
            return keep_calibration(calibration, folder, name, runner)
        path = folder.free(name, ".toml")
        mapped = answer.mapping.applied(skin)
        write_text(path, mapped.to_toml())
        runner.ask(commands.Change(prepare(mapped)))
        return path.name
