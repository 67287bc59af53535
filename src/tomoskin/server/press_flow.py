"""The flows of presses where the dot is: touch is learnt, or the channel mapping found."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, ClassVar

import numpy as np

from tomoskin import learning
from tomoskin.core import FloatArray, write_text
from tomoskin.pipeline import FrameResult, Prepared, prepare
from tomoskin.run import Runner, commands
from tomoskin.server.folder import Folder
from tomoskin.server.guided_flow import (
    EFFORTS,
    Effort,
    Estimate,
    GuidedFlow,
    GuidedPress,
    counted,
)
from tomoskin.server.page_messages import Figures, Point
from tomoskin.server.press_taker import PressTaker

_FEWEST_TOUCH, _FEWEST_MAPPING = 6, 3
_FIRST = 10
"""So many presses fill the sheet; from then on a locator says where the next tells most."""


def estimate_touch(prepared: Prepared, presses: Sequence[GuidedPress]) -> Estimate:
    """A locator of the presses, and by how much it misses them. Raises DataError."""
    if len(presses) < _FEWEST_TOUCH:
        return Estimate(f"{counted(_FEWEST_TOUCH - len(presses))} more for a first estimate")
    dv, xy = _arrays(presses)
    locator = learning.Locator.fit(dv, xy, pattern=prepared.pattern, skin=prepared.skin)
    errors = 1e3 * locator.errors
    doubted = sorted({remark.row for remark in locator.remarks})
    text = f"Median error {_by_effort(presses, errors)} (each press left out in turn)"
    text += _as_it_is(presses, errors)
    left_out = learning.LeftOut.of(locator)
    if left_out.one_force:
        text += (
            ", but all presses were about equally hard: expect larger errors for softer and "
            "harder ones"
        )
    if left_out.is_guess:
        text += "; the mean of all positions is as good an estimate: press harder"
    elif len(presses) < _FIRST:
        text += ". Ten presses are a start, fifty are good"
    if what := learning.worse(learning.growth_of_errors(locator)):
        text += (
            f". But {what}. Take back those that were not on their dot; where the skin has "
            "changed, begin again"
        )
    figures = Figures(
        errors_mm=errors.tolist(), median_mm=float(np.median(errors)), doubtful=doubted
    )
    place = locator.next_place() if len(presses) >= _FIRST else None
    return Estimate(text, place, True, figures, locator)


def _as_it_is(presses: Sequence[GuidedPress], errors: FloatArray) -> str:
    """What a calibration brings, where most presses showed without it."""
    missed = [1e3 * press.missed for press in presses if press.missed is not None]
    if 2 * len(missed) <= len(presses):
        return ""
    brings = "" if np.median(errors) < np.median(missed) else ", and this brings nothing yet"
    return f"; as it is, touches miss the dots by {np.median(missed):.1f} mm{brings}"


def _by_effort(presses: Sequence[GuidedPress], errors: FloatArray) -> str:
    missed = {
        effort: [
            error for press, error in zip(presses, errors, strict=True) if press.effort == effort
        ]
        for effort in EFFORTS
    }
    if not all(missed.values()):
        return f"{np.median(errors):.0f} mm"
    return ", ".join(f"{np.median(mm):.0f} mm pressed {effort}" for effort, mm in missed.items())


def estimate_mapping(
    prepared: Prepared,
    presses: Sequence[GuidedPress],
    untouched: tuple[FloatArray, FloatArray] | None,
) -> Estimate:
    """The likeliest channel mapping and how sure it is; ``untouched`` mean, noise V. DataError."""
    if len(presses) < _FEWEST_MAPPING:
        return Estimate(f"{counted(_FEWEST_MAPPING - len(presses))} more for a first answer")
    dv, xy = _arrays(presses)
    rest, noise = untouched or (None, None)
    solution = learning.solve_channel_mapping(dv, xy, prepared.skin, reference=rest, noise=noise)
    ring = learning.ring_of(prepared.skin)
    figures = Figures(
        mapping=solution.mapping.text(ring),
        probability=solution.probability,
        runner_up=solution.runner_up.text(ring),
        doubtful=[row for row, _, _ in solution.contradicted],
    )
    text = _in_words(solution, figures)
    return Estimate(text, solution.next_place, solution.sure, figures, solution)


def _in_words(solution: learning.MappingAnswer, figures: Figures) -> str:
    if solution.sure:
        return f"Sure: {figures.mapping}"
    if solution.doubtful:
        return "Many presses fit other positions better. Was each press on its dot?"
    if solution.unexplained > 1 - solution.probability - solution.unexplained:
        return "No channel mapping explains these presses well. Press on the dot, and harder"
    return f"Not sure yet: {figures.mapping}, or {figures.runner_up}. The next dot decides"


class DotFlow(GuidedFlow):
    """Presses where the dot is, while there is one; see :class:`GuidedFlow`."""

    efforts: ClassVar[tuple[Effort | None, ...]] = (None,)

    def __init__(self, prepared: Prepared) -> None:
        super().__init__(prepared)
        self._taker: PressTaker | None = PressTaker.of(prepared)
        self._dot: Point | None = self._next_dot()
        self._undone = False

    def see(self, result: FrameResult) -> bool | None:
        """Take a press on the dot, and move the dot on; or say what else is to be done."""
        taker, dot = self._taker, self._dot
        if taker is None or dot is None:
            return None
        before = taker.phase, taker.hint
        if self._undone and taker.phase == "release":  # it may have been no press
            taker.restart()
        self._undone = False
        dv = taker.push(result.host_time, result.voltages, touched=bool(result.touches))
        if dv is None:
            return None if before == (taker.phase, taker.hint) else False
        away = [math.dist((t.detection.x, t.detection.y), dot) for t in result.touches]
        self.taken.append(GuidedPress(dot, dv, self.effort, min(away, default=None)))
        self._dot = self._next_dot()
        return True

    def _next_dot(self) -> Point:
        return self._dots.next([press.place for press in self.taken], self.estimate)

    def restart(self) -> None:
        """Forget the press that is being made."""
        if self._taker is not None:
            self._taker.restart()

    @property
    def effort(self) -> Effort | None:
        """How to press the dot; None where that does not matter."""
        return self.efforts[len(self.taken) % len(self.efforts)]

    def delete(self, number: int | None) -> bool:
        """Remove a press, and ask for it again."""
        self._dot = self.take_back(number).place
        self.estimate, self._undone = None, True
        return True

    @property
    def hint(self) -> str:
        """What is wrong with the press that is being made."""
        return "" if self._taker is None else self._taker.hint

    def details(self) -> dict[str, Any]:
        """What the page shows: the dot to press, and the presses."""
        return {
            "phase": "rub" if self._taker is None else self._taker.phase,
            "dot": self._dot,
            "effort": self.effort,
            "presses": [press.place for press in self.taken],
        }


class TouchFlow(DotFlow):
    """Touch is learnt from presses on dots, soft and hard in turn."""

    kind, teaches, efforts = "touch", learning.TOUCH, EFFORTS

    def estimate_from(self, examples: tuple[GuidedPress, ...]) -> Estimate:
        """Estimate the map of touches from these presses."""
        return estimate_touch(self.prepared, examples)


class MappingFlow(DotFlow):
    """The channel mapping is found from presses on dots."""

    kind = "mapping"

    def estimate_from(self, examples: tuple[GuidedPress, ...]) -> Estimate:
        """Estimate the channel mapping from these presses."""
        untouched = None if self._taker is None else self._taker.untouched
        return estimate_mapping(self.prepared, examples, untouched)

    def keep(
        self, answer: learning.MappingAnswer, folder: Folder, name: str, runner: Runner
    ) -> str:
        """Write a skin file with the mapping, and change over to it."""
        path = folder.free(name, ".toml")
        mapped = answer.mapping.applied(self.prepared.skin)
        write_text(path, mapped.to_toml())
        runner.ask(commands.Change(prepare(mapped)))
        return path.name


def _arrays(presses: Sequence[GuidedPress]) -> tuple[FloatArray, FloatArray]:
    dv = np.array([press.dv for press in presses])
    return dv, np.array([press.place for press in presses])
