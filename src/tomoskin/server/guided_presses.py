"""Presses that a page guides: where they are asked for, and what they tell."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from tomoskin.core import FloatArray
from tomoskin.learning import LeftOut, Locator, MappingAnswer, ring_of, solve_channel_mapping
from tomoskin.pipeline import Prepared
from tomoskin.sensing.segment import Region
from tomoskin.server.guided_flow import Estimate

Effort = Literal["softly", "hard"]
EFFORTS: tuple[Effort, ...] = ("softly", "hard")
"""How a press is asked for, in turn: presses of one force teach that force alone."""

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
class GuidedPress:
    """One press: the place m, the change (n_meas,) V that it made, and how it was asked for."""

    place: tuple[float, float]
    dv: FloatArray
    effort: Effort | None = None


def estimate_touch(prepared: Prepared, presses: Sequence[GuidedPress]) -> Estimate:
    """A locator of the presses, and by how much it misses them. Raises DataError."""
    if len(presses) < _FEWEST_TOUCH:
        left = _FEWEST_TOUCH - len(presses)
        return Estimate(f"{_counted(left)} more for a first estimate")
    dv, xy = _arrays(presses)
    locator = Locator.fit(dv, xy, pattern=prepared.pattern, skin=prepared.skin)
    errors = 1e3 * locator.errors
    doubted = sorted({remark.row for remark in locator.remarks})
    text = f"Median error {_by_effort(presses, errors)} (each press left out in turn)"
    left_out = LeftOut.of(locator)
    if left_out.one_force:
        text += (
            ", but all presses were about equally hard: expect larger errors for softer and "
            "harder ones"
        )
    if left_out.is_guess:
        text += "; the mean of all positions is as good an estimate: press harder"
    elif len(presses) < _FIRST:
        text += ". Ten presses are a start, fifty are good"
    figures = {
        "errors_mm": errors.tolist(),
        "median_mm": float(np.median(errors)),
        "doubtful": doubted,
    }
    place = locator.next_place() if len(presses) >= _FIRST else None
    return Estimate(text, place, True, figures, locator)


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


def estimate_wiring(
    prepared: Prepared,
    presses: Sequence[GuidedPress],
    untouched: tuple[FloatArray, FloatArray] | None,
) -> Estimate:
    """The likeliest channel mapping and how sure it is; ``untouched`` mean, noise V. DataError."""
    if len(presses) < _FEWEST_WIRING:
        left = _FEWEST_WIRING - len(presses)
        return Estimate(f"{_counted(left)} more for a first answer")
    dv, xy = _arrays(presses)
    rest, noise = untouched or (None, None)
    solution = solve_channel_mapping(dv, xy, prepared.skin, reference=rest, noise=noise)
    ring = ring_of(prepared.skin)
    figures = {
        "mapping": solution.mapping.text(ring),
        "probability": solution.probability,
        "odds": min(solution.odds, 1e9),
        "runner_up": solution.runner_up.text(ring),
        "polarity_known": solution.polarity_known,
        "doubtful": [row for row, _, _ in solution.contradicted],
    }
    return Estimate(
        _in_words(solution, figures), solution.next_place, solution.sure, figures, solution
    )


def _in_words(solution: MappingAnswer, figures: dict[str, object]) -> str:
    if solution.sure:
        return f"Sure: {figures['mapping']}"
    if solution.doubtful:
        return "Many presses fit other positions better. Was each press on its dot?"
    if solution.unexplained > 1 - solution.probability - solution.unexplained:
        return "No channel mapping explains these presses well. Press on the dot, and harder"
    return f"Not sure yet: {figures['mapping']}, or {figures['runner_up']}. The next dot decides"


class Dots:
    """Where to press next: where a estimate says, else where nobody has pressed yet."""

    def __init__(self, prepared: Prepared) -> None:
        region = Region.of(prepared.skin)
        self._unit = region.unit
        self._places = region.metres(_INSIDE * region.grid)
        self._filled = region.metres(_FILLED * region.grid)

    @property
    def places(self) -> FloatArray:
        """(n, 2) m where a dot may be."""
        return self._places

    def next(
        self, places: Sequence[tuple[float, float]], estimate: Estimate | None
    ) -> tuple[float, float]:
        """(x, y) m of the next dot, after presses at ``places``."""
        pressed = np.array(places).reshape(-1, 2)
        if estimate is not None and estimate.place is not None:
            near = np.argmin(np.linalg.norm(self._places - estimate.place, axis=1))
            place = self._places[near]
            if _gap(pressed, place[None])[0] > _APART * self._unit:
                return float(place[0]), float(place[1])
        if not len(pressed):
            return self._first()
        x, y = self._filled[int(np.argmax(_gap(pressed, self._filled)))].tolist()
        return x, y

    def _first(self) -> tuple[float, float]:
        """Off every axis of the sheet: a press in the middle allows every rotation."""
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


def _arrays(presses: Sequence[GuidedPress]) -> tuple[FloatArray, FloatArray]:
    dv = np.array([press.dv for press in presses])
    return dv, np.array([press.place for press in presses])


def _counted(left: int) -> str:
    return f"{left} press{'es' if left != 1 else ''}"
