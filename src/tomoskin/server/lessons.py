"""What presses at known places tell, press by press: of touch, or of the wiring."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from tomoskin.calibration import Locator, WiringAnswer, ring_of, solve_wiring
from tomoskin.core import FloatArray
from tomoskin.pipeline import Prepared
from tomoskin.touch import Region

_FEWEST_TOUCH, _FEWEST_WIRING = 6, 3
_FIRST = 10
"""So many presses fill the sheet; from then on a locator says where the next tells most."""

_FILLED, _INSIDE = 0.6, 0.85
"""Parts of the way to the rim that dots stay within: those that fill the sheet, since presses all
round the rim teach little at first (the twin's textile disc, ten presses: missed by 12 mm instead
of 51), and all others, since a finger does not press half a sheet."""

_APART = 0.12
"""A dot is no nearer to a press than this, in radii of the sheet: it would tell nothing new."""


@dataclass(frozen=True, eq=False)
class Lesson:
    """One press: the place m, and the change (n_meas,) V that it made."""

    place: tuple[float, float]
    dv: FloatArray


@dataclass(frozen=True, eq=False)
class Thought:
    """What presses tell so far.

    ``text`` in words; ``place`` (2,) m where a further press tells most, None where that is not
    known; ``ready``: it can be kept; ``figures`` for a page; ``answer`` what is kept.
    """

    text: str
    place: FloatArray | None = None
    ready: bool = False
    figures: dict[str, Any] = field(default_factory=dict)
    answer: Locator | WiringAnswer | None = None


def touch_thought(prepared: Prepared, lessons: Sequence[Lesson]) -> Thought:
    """A locator of the presses, and by how much it misses them. Raises DataError."""
    if len(lessons) < _FEWEST_TOUCH:
        left = _FEWEST_TOUCH - len(lessons)
        return Thought(f"{_counted(left)} to go for a first estimate")
    dv, xy = _arrays(lessons)
    locator = Locator.fit(dv, xy, pattern=prepared.pattern, skin=prepared.skin)
    errors = 1e3 * locator.errors
    doubted = sorted({remark.row for remark in locator.remarks})
    text = f"Missed by {np.median(errors):.0f} mm (median; each press left out in turn)"
    if len(lessons) < _FIRST:
        text += ": ten presses are a start, fifty are good"
    figures = {
        "errors_mm": errors.tolist(),
        "median_mm": float(np.median(errors)),
        "doubtful": doubted,
    }
    place = locator.next_place() if len(lessons) >= _FIRST else None
    return Thought(text, place, True, figures, locator)


def wiring_thought(
    prepared: Prepared,
    lessons: Sequence[Lesson],
    untouched: tuple[FloatArray, FloatArray] | None,
) -> Thought:
    """The likeliest wiring and how sure that is; ``untouched`` mean and noise V. DataError."""
    if len(lessons) < _FEWEST_WIRING:
        left = _FEWEST_WIRING - len(lessons)
        return Thought(f"{_counted(left)} to go for a first answer")
    dv, xy = _arrays(lessons)
    rest, noise = untouched or (None, None)
    found = solve_wiring(dv, xy, prepared.skin, reference=rest, noise=noise)
    ring = ring_of(prepared.skin)
    figures = {
        "wiring": found.wiring.text(ring),
        "probability": found.probability,
        "odds": min(found.odds, 1e9),
        "runner_up": found.runner_up.text(ring),
        "polarity_known": found.polarity_known,
        "doubtful": [row for row, _, _ in found.contradicted],
    }
    return Thought(_said(found, figures), found.next_place, found.sure, figures, found)


def _said(found: WiringAnswer, figures: dict[str, Any]) -> str:
    if found.sure:
        return f"Sure: {figures['wiring']}"
    if found.doubtful:
        return "Too many presses look as if they were elsewhere: was each made on its dot?"
    if found.unexplained > 1 - found.probability - found.unexplained:
        return "No wiring explains these presses well: press on the dot, and harder"
    return f"Not sure yet: {figures['wiring']}, or {figures['runner_up']}. The dot tells them apart"


class Dots:
    """Where to press next: where a thought says, else where nobody has pressed yet."""

    def __init__(self, prepared: Prepared) -> None:
        region = Region.of(prepared.skin)
        self._unit = region.unit
        self._places = region.metres(_INSIDE * region.grid)
        self._filled = region.metres(_FILLED * region.grid)

    def next(self, lessons: Sequence[Lesson], thought: Thought | None) -> tuple[float, float]:
        """(x, y) m of the next dot."""
        pressed = np.array([lesson.place for lesson in lessons]).reshape(-1, 2)
        if thought is not None and thought.place is not None:
            near = np.argmin(np.linalg.norm(self._places - thought.place, axis=1))
            place = self._places[near]
            if _gap(pressed, place[None])[0] > _APART * self._unit:
                return float(place[0]), float(place[1])
        if not len(pressed):
            return self._first()
        x, y = self._filled[int(np.argmax(_gap(pressed, self._filled)))].tolist()
        return x, y

    def _first(self) -> tuple[float, float]:
        """Off every axis of the sheet: a press in the middle tells no wiring from its turns."""
        middle, extent = self._filled.mean(axis=0), np.ptp(self._filled, axis=0)
        wanted = middle + extent * (0.32, 0.16)
        x, y = self._filled[int(np.argmin(np.linalg.norm(self._filled - wanted, axis=1)))].tolist()
        return x, y


def _gap(pressed: FloatArray, places: FloatArray) -> FloatArray:
    """(n,) m from each of ``places`` (n, 2) to the nearest of ``pressed`` (k, 2)."""
    if not len(pressed):
        return np.full(len(places), np.inf)
    apart = np.linalg.norm(places[:, None] - pressed, axis=-1)
    return np.asarray(apart.min(axis=1))


def _arrays(lessons: Sequence[Lesson]) -> tuple[FloatArray, FloatArray]:
    dv = np.array([lesson.dv for lesson in lessons])
    return dv, np.array([lesson.place for lesson in lessons])


def _counted(left: int) -> str:
    return f"{left} press{'es' if left != 1 else ''}"
