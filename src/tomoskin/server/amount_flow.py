"""The flow of presses with known weights, or to known depths: these are learnt from them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from tomoskin import learning
from tomoskin.core import DataError, Detection, FloatArray, Touch, WireError
from tomoskin.pipeline import FrameResult, Prepared
from tomoskin.server.guided_flow import Estimate, GuidedFlow, counted
from tomoskin.server.page_messages import Figures, LabelNow, Phase, Point
from tomoskin.server.press_taker import OFTEN
from tomoskin.server.requests import SetLabel

_ENOUGH, _GOOD = 10, 20
"""Presses from which amounts are learnt, that are enough to begin with, and that are good."""


_STILL_FOR, _FEWEST_FRAMES = 0.6, 8
"""Seconds, and frames, for which something must lie still: a hand that lowers it does not."""

_CREEPS, _WAVERS = 0.04, 2.0
"""How far it may move meanwhile, from the first half to the second: its change of the sheet as a
part of itself, or in deviations of such a mean where that is more."""

_SLIDES = 3e-3
"""The same of its position, m."""

_GONE = 3
"""Frames without a touch after which nothing lies there."""

_PATIENCE = 3.0
"""Seconds of lying there after which it is said why nothing is recorded."""

_EARLY = "Not recorded: it was lifted before it had rested for 0.6 s. Let it rest."
_MOVES = "Not recorded yet: it still moves or sinks in. Let it rest, or lift it and press again."


@dataclass(frozen=True, eq=False)
class Placement:
    """What one thing did from the moment it was laid on until it lay still: detections in the order
    of ``time`` (n,) s, and the one of them, ``still``, that stands for it lying still."""

    detections: tuple[Detection, ...]
    time: FloatArray
    still: int

    @property
    def xy(self) -> Point:
        """The position of the weight, in m."""
        detection = self.detections[self.still]
        return detection.x, detection.y


class PlacementTaker:
    """Takes placements, one at a time; each lies alone, and is lifted before the next.

    What leads up to it is kept: a sheet remembers.
    """

    def __init__(self) -> None:
        self.phase: Phase = "rest"
        self.hint = ""
        self._rows: list[tuple[float, Detection]] = []
        self._id = 0
        self._empty = 0

    def push(self, time: float, touches: Sequence[Touch]) -> Placement | None:
        """Take the touches of a frame at ``time`` s; the placement when it has lain still."""
        if not touches:
            self._empty += 1
            if self._empty >= _GONE:
                if self.phase != "press":
                    self.hint = _EARLY if self.phase == "hold" else ""
                self.phase = "press"
                self._rows.clear()
            return None
        self._empty = 0
        if self.phase in {"rest", "release"}:
            return None
        if len(touches) > 1 or touches[0].merged:
            self.phase = "several"
            self._rows.clear()
            return None
        return self._alone(time, touches[0])

    def _alone(self, time: float, touch: Touch) -> Placement | None:
        if self.phase != "hold":
            self.phase, self.hint = "hold", ""
        if touch.id != self._id:
            self._id = touch.id
            self._rows.clear()
        if self._rows and 0 <= time - self._rows[-1][0] < OFTEN:
            return None
        self._rows.append((time, touch.detection))
        still = self._still()
        if still is None:
            if time - self._rows[0][0] > _PATIENCE:
                self.hint = _MOVES
            return None
        self.phase, self.hint = "release", ""
        times, detections = zip(*self._rows, strict=True)
        self._rows.clear()
        return Placement(detections, np.array(times), still)

    def _still(self) -> int | None:
        """Number of the row that stands for it, once it lies still."""
        times = np.array([time for time, _ in self._rows])
        first = int(np.searchsorted(times, times[-1] - _STILL_FOR))
        if times[-1] - times[0] < _STILL_FOR or len(times) - first < _FEWEST_FRAMES:
            return None
        late = [detection for _, detection in self._rows[first:]]
        content = np.array([abs(d.peak) * d.area for d in late])
        xy = np.array([(d.x, d.y) for d in late])
        half = len(late) // 2
        moved = abs(content[half:].mean() - content[:half].mean())
        usual = content.std() * np.sqrt(2 / half)
        slid = np.linalg.norm(xy[half:].mean(axis=0) - xy[:half].mean(axis=0))
        if moved > max(_CREEPS * content.mean(), _WAVERS * usual) or slid > _SLIDES:
            return None
        middle = np.argsort(content)[len(content) // 2]
        return first + int(middle)


LabelledPlacement = tuple[Placement, learning.AmountLabel]
"""A placement, and what is said of it."""


class AmountFlow(GuidedFlow):
    """Presses of a known amount so far; see :class:`GuidedFlow`.

    Attributes
    ----------
    of
        What is known of the presses.
    taken
        Placements so far, each with its label.
    label
        What presses now, or comes next; None where that has not been said.
    asked
        What was said, where it is probably meant otherwise.
    skin_says
        Gives the amount in SI of the press on a simulated skin that knows it, else None.
    """

    def __init__(self, prepared: Prepared) -> None:
        super().__init__(prepared)
        self.of = learning.MEASURED[self.kind]
        self.label: learning.AmountLabel | None = None
        self.asked: learning.AmountLabel | None = None
        self.skin_says: Callable[[], float | None] = lambda: None
        self.answers[SetLabel] = self._set
        self._taker = PlacementTaker()
        self._waiting: Placement | None = None

    def see(self, result: FrameResult) -> bool | None:
        """Take a placement, or say that a phase has begun."""
        taker = self._taker
        before = taker.phase, taker.hint
        placement = taker.push(result.host_time, result.touches)
        if placement is None:
            return None if before == (taker.phase, taker.hint) else False
        self._waiting = placement
        if (known := self.skin_says()) is not None:
            value = round(known / self.of.units[self.of.shown], 3)
            self.label = learning.AmountLabel(value, self.of.shown, self.of)
        return self._record()

    def restart(self) -> None:
        """Forget the press that has begun."""
        self._taker = PlacementTaker()

    def _record(self) -> bool:
        """Put the placement that waits on the list, once its amount has been said."""
        if self._waiting is None or self.label is None:
            return False
        self.taken.append((self._waiting, self.label))
        self._waiting = None
        return True

    def _set(self, request: SetLabel) -> bool:
        label = learning.AmountLabel(request.value, request.unit, self.of)
        self.asked = None if request.sure or label.meant is None else label
        try:
            self.label = None if self.asked else label.checked(self.prepared.skin.layer)
        except DataError as error:
            raise WireError(str(error)) from None
        return self._record()

    @property
    def hint(self) -> str:
        """Why no placement is recorded."""
        return self._taker.hint

    def estimate_from(self, examples: tuple[LabelledPlacement, ...]) -> Estimate:
        """Learn the amounts of touches from these presses."""
        if len(examples) < learning.FEWEST_LABELS:
            return Estimate(
                f"{counted(learning.FEWEST_LABELS - len(examples))} more for a first answer"
            )
        model = learning.AmountModel.fit(labelled_presses(examples), self.prepared.skin)
        return Estimate(
            f"{learning.report_of(model)['text']}. {_advice(model)}",
            learning.least_known(model, self._dots.places),
            ready=True,
            figures=Figures(
                errors=model.errors.tolist(),
                doubtful=[r.press for r in model.remarks if r.press is not None],
                remarks=[_of_press(r.press) + r.reason for r in model.remarks],
            ),
            answer=model,
        )

    def details(self) -> dict[str, Any]:
        """What the page shows: the dot, and the presses so far."""
        places = [placement.xy for placement, _ in self.taken]
        said = {"label": self.label, "asked": self.asked, "meant": self.asked and self.asked.meant}
        return {
            "phase": "name" if self._waiting else self._taker.phase,
            "dot": self._dots.next(places, self.estimate),
            "presses": places,
            "labels": [label.text for _, label in self.taken],
            **{name: label and LabelNow.of(label) for name, label in said.items()},
        }


class ForceFlow(AmountFlow):
    """The flow in which known weights are laid on the skin."""

    kind, teaches = "force", learning.FORCE


class DepthFlow(AmountFlow):
    """A tip is lowered to known depths."""

    kind, teaches = "depth", learning.DEPTH


def labelled_presses(examples: tuple[LabelledPlacement, ...]) -> learning.LabelledPresses:
    """What is learnt from: of each placement the way there, labelled where it lies still.

    Raises DataError as :meth:`LabelledPresses.of` does.
    """
    placements, labels = zip(*examples, strict=True)
    detections = [detection for one in placements for detection in one.detections]
    length = [len(one.detections) for one in placements]
    amount = np.full(len(detections), np.nan)
    still = np.cumsum([0, *length[:-1]]) + [one.still for one in placements]
    amount[still] = [label.si for label in labels]
    press = np.repeat(np.arange(len(examples)), length)
    time = np.concatenate([one.time for one in placements])
    return learning.LabelledPresses.of(detections, amount, press, time, labels[0].of.name)


def _advice(model: learning.AmountModel) -> str:
    n = len(np.unique(model.presses.press[model.presses.labelled]))
    if n < _ENOUGH:
        return f"Ten presses are a start: {counted(_ENOUGH - n)} more."
    if model.remarks:
        return "These would be enough without the problems below."
    if n < _GOOD:
        return "Ten are enough to begin with, twenty are good."
    return "That is enough."


def _of_press(number: int | None) -> str:
    return "" if number is None else f"Press {number + 1}: "
