"""The flow in which one finger rubs all of the skin, and touch is learnt without labels."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass
from typing import Any

import numpy as np

from tomoskin.core import FloatArray, WireError, reach
from tomoskin.extras.alignment.rubbing import Rubbing, quiet_electrodes
from tomoskin.files.messages import Every
from tomoskin.learning import TOUCH
from tomoskin.pipeline import FrameResult, Prepared
from tomoskin.sensing.segment import Region
from tomoskin.server import (
    OFTEN,
    AskPoint,
    DotFlow,
    Estimate,
    Figures,
    LearnFlow,
    PressTaker,
    RubbedNow,
    StopLearning,
)

_FEWEST, _GOOD = 150, 400
"""Touches from which it can be learnt, and that are good."""

_MOST = 3000
"""Touches that are kept; of more, every second is forgotten."""

_COURSE = 600
"""Newest frames that tell how far the sheet lags behind a finger that slides."""

_NEW, _STANDS_OUT = 0.15, 3.0
"""Part of itself, and of the noise of a frame, by which a touch must differ from the last one to
tell something new."""

_PLACES, _FINGER = 250, 0.12
"""Positions of the map, and radius of what a touch covers of it, in radii of the skin."""

_COVERED = 0.9
"""Part of the map that must be covered."""

_SEVERAL = 0.2
"""Part of the frames with several touches from which it is said."""

_PERIOD = 0.25
"""Seconds between two looks of the pages."""


@dataclass(frozen=True, eq=False)
class Rubbed:
    """Touches so far.

    Attributes
    ----------
    dv
        (n, n_meas) V by which each differs from the untouched skin.
    course
        s and (n_meas,) V of the newest frames with one touch, like each other or not.
    covered
        (k,) how many of them lie near each position of the map.
    several
        Frames that showed several touches.
    frames
        Frames that showed any.
    quiet
        Electrodes that none came near.
    """

    dv: FloatArray
    course: tuple[tuple[float, FloatArray], ...]
    covered: FloatArray
    several: int = 0
    frames: int = 0
    quiet: tuple[int, ...] = ()

    @property
    def part(self) -> float:
        """Part of the map that is covered."""
        return float((self.covered > 0).mean())

    @property
    def enough(self) -> bool:
        """Whether it can be learnt from without a gap."""
        return len(self.dv) >= _FEWEST and self.part >= _COVERED and not self.quiet

    @property
    def gap(self) -> tuple[str, ...]:
        """That much of the skin was not touched, in words; nothing where that is not so."""
        if self.part >= _COVERED:
            return ()
        return (
            f"only {100 * self.part:.0f} % of the skin was touched: positions elsewhere are not "
            "learnt, and those that are found may be anywhere",
        )

    @property
    def text(self) -> str:
        """What is still missing, in words."""
        words = []
        if self.frames > _FEWEST / 3 and self.several > _SEVERAL * self.frames:
            words.append(
                f"{100 * self.several / self.frames:.0f} % of the frames show several touches and "
                "are left out: rub with one finger of one hand, and more slowly."
            )
        if len(self.dv) < _FEWEST:
            words.append(f"{_FEWEST - len(self.dv)} more to learn from.")
        elif self.part < _COVERED:
            words.append(
                f"{100 * self.part:.0f} % of the skin is touched: go on where the map is empty."
            )
        elif self.quiet:
            names = ", ".join(f"E{electrode + 1}" for electrode in self.quiet)
            words.append(f"No touch has come near {names} yet: rub out to the rim.")
        elif len(self.dv) < _GOOD:
            words.append(f"Enough to learn from. {_GOOD} are better: a minute of rubbing.")
        else:
            words.append("Enough.")
        return " ".join(words)


class RubbedTouches:
    """Collects touches from frames; belongs to the thread that sees these."""

    def __init__(self, prepared: Prepared) -> None:
        region = Region.of(prepared.skin)
        self._pattern = prepared.pattern
        self.places = region.metres(region.lattice(_PLACES))
        self.near = _FINGER * region.unit
        self._dv: list[FloatArray] = []
        self._course: deque[tuple[float, FloatArray]] = deque(maxlen=_COURSE)
        self._covered = np.zeros(len(self.places))
        self._several = self._frames = 0
        self._is_due = Every(OFTEN)

    def push(self, result: FrameResult) -> None:
        """Take a frame, where it shows one touch that is not the last one again."""
        if not result.touches or not self._is_due(result.host_time):
            return
        self._frames += 1
        if len(result.touches) > 1 or result.touches[0].merged:
            self._several += 1
            return
        dv = result.voltages - result.reference
        if result.health is not None:
            dv = np.where(result.health.lost, np.nan, dv)
        noise = result.baseline.noise if result.baseline else 0.0
        self._course.append((result.host_time, dv))
        least = max(_NEW * _rms(dv), _STANDS_OUT * noise)
        if self._dv and _rms(dv - self._dv[-1]) < least:
            return
        self._dv.append(dv)
        if len(self._dv) > _MOST:
            del self._dv[::2]
        touch = result.touches[0].detection
        apart = np.linalg.norm(self.places - (touch.x, touch.y), axis=1)
        self._covered = self._covered + (apart < self.near)

    def now(self) -> Rubbed:
        """The touches that were rubbed so far."""
        dv = np.array(self._dv).reshape(-1, self._pattern.n_meas)
        some = dv[:: max(1, len(dv) // _GOOD)]
        quiet = quiet_electrodes(some, self._pattern) if len(dv) >= _FEWEST else ()
        course = tuple(self._course)
        return Rubbed(dv, course, self._covered, self._several, self._frames, quiet)


class RubFlow(DotFlow):
    """What was rubbed so far, with presses on dots where these are asked for; see :class:`DotFlow`.
    It learns when it is asked to.

    ``rubbed``: touches everywhere; ``taken``: presses at known positions.
    """

    kind, teaches = "rub", TOUCH

    def __init__(self, prepared: Prepared) -> None:
        super().__init__(prepared)
        self._taker = self._dot = None
        self._touches = RubbedTouches(prepared)
        self.rubbed = self._touches.now()
        self.answers |= {
            AskPoint: lambda request: self._ask(on=request.on),
            LearnFlow: lambda _: self._learn(),
            StopLearning: lambda _: self._stop(),
        }
        self._examples: tuple[Any, ...] = ()
        self._shown = -np.inf

    def see(self, result: FrameResult) -> bool | None:
        """Take a touch, or a press at the dot."""
        news = super().see(result)
        if self._taker is None:
            self._touches.push(result)
        if news is None and 0 <= result.host_time - self._shown < _PERIOD:
            return None
        self._shown = result.host_time
        self.rubbed = self._touches.now()
        return False

    def _ask(self, *, on: bool) -> bool:
        self._taker = PressTaker.of(self.prepared) if on else None
        self._dot = self._next_dot() if on else None
        return False

    def delete(self, number: int | None) -> bool:
        """Remove a press, and ask for it again where presses are asked for."""
        place = self.take_back(number).place
        self._dot = None if self._taker is None else place
        return False

    def _learn(self) -> bool:
        if len(self.rubbed.dv) < _FEWEST:
            raise WireError(f"{_FEWEST - len(self.rubbed.dv)} more touches are needed")
        self._examples = (self.rubbed, tuple(self.taken))
        self.estimate = None
        return True

    def _stop(self) -> bool:
        self.stop()
        return False

    def examples(self) -> tuple[Any, ...]:
        """What was there when it was asked to learn."""
        return self._examples

    def estimate_from(self, examples: tuple[Any, ...]) -> Estimate:
        """Estimate where the rubbed touches were, and a map from them."""
        rubbed, points = examples
        self.stage = "finding where the touches were"
        dv = np.array([*(point.dv for point in points), *rubbed.dv])
        unknown = np.full((len(rubbed.dv), 2), np.nan)
        xy = np.array([*(point.place for point in points), *unknown])
        answer = Rubbing.of(dv, self.prepared.skin, xy)

        def learnt(done: float, total: float) -> None:
            self.stage = f"learning, {100 * done / total:.0f} %"
            reach()

        return Estimate(
            f"{answer.text}.",
            ready=True,
            figures=Figures(
                deviation_mm=1e3 * answer.deviation, remarks=[*rubbed.gap, *answer.findings]
            ),
            answer=answer.locator(learnt).sliding(*zip(*rubbed.course, strict=True)),
        )

    def details(self) -> dict[str, Any]:
        """What the page shows: the dot, the presses on dots, and what was rubbed."""
        rubbed = self.rubbed
        return super().details() | {
            "stage": self.stage,
            "rubbed": RubbedNow.of(
                rubbed,
                touches=len(rubbed.dv),
                needed=_FEWEST,
                places=self._touches.places.ravel().tolist(),
                covered=rubbed.covered.tolist(),
            ),
        }


def _rms(values: FloatArray) -> float:
    return float(np.sqrt(np.nanmean(values**2)))
