"""The flow in which known weights are laid on the skin, and forces are learnt from them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from tomoskin.core import DataError, WireError
from tomoskin.learning import FORCE, ForceModel, ForceReport, WeighedPresses, Weight, least_known
from tomoskin.pipeline import FrameResult, Prepared
from tomoskin.run import Runner
from tomoskin.server.folder import Folder
from tomoskin.server.guided_flow import Estimate, GuidedFlow, keep_calibration
from tomoskin.server.guided_presses import Dots
from tomoskin.server.placements import Placement, PlacementTaker, PlacingPhase
from tomoskin.server.requests import DeletePress, SetWeight, UndoPress

_FEWEST, _ENOUGH, _GOOD = 5, 10, 20
"""Placements from which forces are learnt, that are enough to begin with, and that are good."""


@dataclass(frozen=True, eq=False)
class Weighed:
    """A placement, and what lay there."""

    placement: Placement
    weight: Weight


@dataclass(frozen=True, eq=False)
class _Seen:
    """A phase that has begun, and the placement that was taken, or None."""

    phase: PlacingPhase
    placement: Placement | None


class WeighFlow(GuidedFlow):
    """Weights that lay on the skin so far; see :class:`GuidedFlow`.

    Attributes
    ----------
    weighed
        Placements so far, each with its weight.
    weight
        What lies there, or comes next; None where that has not been said.
    asked
        What was said, where it is probably meant otherwise.
    """

    def __init__(self, prepared: Prepared) -> None:
        super().__init__("force", prepared)
        self.weighed: list[Weighed] = []
        self.weight: Weight | None = None
        self.asked: Weight | None = None
        self.answers = {
            SetWeight: self._set,
            DeletePress: lambda request: self._delete(request.number),
            UndoPress: lambda _: self._delete(len(self.weighed) - 1),
        }
        self._taker = PlacementTaker()
        self._phase: PlacingPhase = self._taker.phase
        self._waiting: Placement | None = None
        self._dots = Dots(prepared)

    def see(self, result: FrameResult) -> _Seen | None:
        """See :class:`GuidedFlow`."""
        before = self._taker.phase
        placement = self._taker.push(result.host_time, result.touches)
        changed = placement is not None or self._taker.phase != before
        return _Seen(self._taker.phase, placement) if changed else None

    def take(self, seen: _Seen) -> bool:
        """A placement was taken, or a phase has begun."""
        self._phase = seen.phase
        if seen.placement is None:
            return False
        self._waiting = seen.placement
        return self._record()

    def _record(self) -> bool:
        """Put the placement that waits on the list, once its weight has been said."""
        if self._waiting is None or self.weight is None:
            return False
        self.weighed.append(Weighed(self._waiting, self.weight))
        self._waiting = None
        return True

    def _set(self, request: SetWeight) -> bool:
        weight = Weight(request.value, request.unit)
        self.asked = None if request.sure or weight.meant is None else weight
        try:
            self.weight = None if self.asked else weight.checked()
        except DataError as error:
            raise WireError(str(error)) from None
        return self._record()

    def _delete(self, number: int) -> bool:
        if not 0 <= number < len(self.weighed):
            raise WireError("there is no press to undo")
        del self.weighed[number]
        self.estimate = None
        return True

    def examples(self) -> tuple[Weighed, ...]:
        """See :class:`GuidedFlow`."""
        return tuple(self.weighed)

    def estimate_from(self, examples: tuple[Weighed, ...]) -> Estimate:
        """See :class:`GuidedFlow`."""
        if len(examples) < _FEWEST:
            return Estimate(f"{_counted(_FEWEST - len(examples))} more for a first answer")
        model = ForceModel.fit(weighed_presses(examples), self.prepared.skin)
        report = ForceReport.of(model)
        return Estimate(
            f"{report.text}. {_advice(report)}",
            least_known(model, self._dots.places),
            ready=True,
            figures={
                "errors": model.errors.tolist(),
                "doubtful": [r.press for r in report.remarks if r.press is not None],
                "remarks": [_of_press(r.press) + r.reason for r in report.remarks],
            },
            answer=model,
        )

    def details(self) -> dict[str, Any]:
        """See :class:`GuidedFlow`."""
        places = [one.placement.xy for one in self.weighed]
        return {
            "phase": "name" if self._waiting else self._phase,
            "dot": self._dots.next(places, self.estimate),
            "presses": places,
            "weights": [one.weight.text for one in self.weighed],
            "weight": _fields(self.weight),
            "asked": _fields(self.asked),
            "meant": _fields(self.asked and self.asked.meant),
        }

    def keep(self, answer: ForceModel, folder: Folder, name: str, runner: Runner) -> str:
        """See :class:`GuidedFlow`."""
        calibration = FORCE.of(answer, self.prepared.pattern, self.prepared.skin)
        return keep_calibration(calibration, folder, name, runner)


def weighed_presses(examples: tuple[Weighed, ...]) -> WeighedPresses:
    """What is learnt from: of each placement the way there, labelled where it lies still.

    Raises DataError as :meth:`WeighedPresses.of` does.
    """
    detections = [d for one in examples for d in one.placement.detections]
    length = [len(one.placement.detections) for one in examples]
    force = np.full(len(detections), np.nan)
    still = np.cumsum([0, *length[:-1]]) + [one.placement.still for one in examples]
    force[still] = [one.weight.newtons for one in examples]
    press = np.repeat(np.arange(len(examples)), length)
    time = np.concatenate([one.placement.time for one in examples])
    return WeighedPresses.of(detections, force, press, time)


def _advice(report: ForceReport) -> str:
    n = report.presses
    if n < _ENOUGH:
        return f"Ten placements are a start: {_counted(_ENOUGH - n)} more."
    if report.remarks:
        return "These would be enough without the problems below."
    if n < _GOOD:
        return "Ten are enough to begin with, twenty are good."
    return "That is enough."


def _of_press(number: int | None) -> str:
    return "" if number is None else f"Placement {number + 1}: "


def _fields(weight: Weight | None) -> dict[str, Any] | None:
    if weight is None:
        return None
    return {
        "value": weight.value, "unit": weight.unit, "newtons": weight.newtons, "text": weight.text,
    }  # fmt: skip


def _counted(left: int) -> str:
    return f"{left} placement{'s' if left != 1 else ''}"
