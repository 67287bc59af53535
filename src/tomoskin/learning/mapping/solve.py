"""The mapping that labelled presses tell: the likeliest plausible one, and how sure that is."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from itertools import chain

import numpy as np
from numpy.typing import ArrayLike

from tomoskin.core import DataError, FloatArray
from tomoskin.learning.mapping.mapping import (
    ChannelMapping,
    IndentationResponses,
    MappingLikelihood,
    agreement,
    likelihood,
    quiet_noise,
    ring_of,
    swaps,
    turns,
)
from tomoskin.learning.touch.presses import Presses
from tomoskin.model.skin import Skin
from tomoskin.sensing.segment import Region

Advance = Callable[[float, float], None]

SURE = 0.95
"""Probability from which an answer is taken for sure."""

_WORTH = 10.0
"""Independent readings of a press: few, as what the model misses is alike in many rows."""

_TRIED = 1000
"""Exchanges that are tried at a time: all of those of so many of the best mappings, at least 6."""

_MOST_SWAPS = 3
_SWAPPED = 0.1
"""Probability beforehand that two wires are exchanged, given all the others."""

_NOTHING = 0.1
"""Probability beforehand that the presses do not tell of any mapping."""

_ASKED = 160
"""Places at which a further press is thought of."""

_ALIKE = 0.999
"""Two mappings whose answers agree so well at all places are one."""

_ELSEWHERE = 8.0
"""Log-likelihood by which a press must fit better at another place to be remarked on."""

_DOUBTFUL = 0.25
"""Part of the presses that may be remarked on, where the answer is still sure: beyond that it is
the mapping that is wrong."""

_FAR = 0.2
"""How far that place must be from the label, in parts of the sheet's extent."""


@dataclass(frozen=True, eq=False)
class MappingAnswer:
    """What labelled presses say of the mapping.

    Attributes
    ----------
    presses
        How many there were.
    mapping, probability
        The likeliest, with all that no press could tell from it.
    runner_up, odds
        The likeliest that is not equivalent, and how many times as likely the first is.
    unexplained
        Probability that the presses follow from none.
    polarity_known
        Whether the data can tell the polarity: they hold the untouched skin, or the skin file
        says what a press does to the conductivity.
    next_place
        (2,) m where a further press tells the two apart best.
    contradicted
        Presses whose data look like a press elsewhere, and that place: (row, x, y) m.
    """

    presses: int
    mapping: ChannelMapping
    probability: float
    runner_up: ChannelMapping
    odds: float
    unexplained: float
    polarity_known: bool
    next_place: FloatArray
    contradicted: tuple[tuple[int, float, float], ...]

    @property
    def sure(self) -> bool:
        """Whether the presses tell: the probability is high, and most of them fit their labels."""
        return bool(self.probability >= SURE and not self.doubtful)

    @property
    def doubtful(self) -> bool:
        """Whether too many presses look as if they were elsewhere."""
        return len(self.contradicted) > _DOUBTFUL * self.presses

    @property
    def reason(self) -> str:
        """Why it is not sure, in words."""
        if self.doubtful:
            return "too many of these presses fit other positions better: check the labels"
        if self.unexplained > 1 - self.probability - self.unexplained:
            return "no channel mapping explains these presses well enough"
        return (
            "these presses do not decide it: the most likely channel mapping has a probability of "
            f"{self.probability:.2f}"
        )


def solve_channel_mapping(
    dv: ArrayLike,
    xy: ArrayLike,
    skin: Skin,
    *,
    reference: FloatArray | None = None,
    noise: FloatArray | None = None,
    progress: Advance = lambda _done, _total: None,
) -> MappingAnswer:
    """Which mapping explains labelled presses.

    Every rotation, mirroring and polarity is weighed, and from the best of them up to three
    exchanges of two wires. A drive and a measuring cable that are swapped measure the same
    (reciprocity), so that nothing has to be solved.

    Parameters
    ----------
    dv
        (n, n_meas) V, pressed minus untouched, in the rows of the skin's pattern as it is drawn.
    xy
        (n, 2) m, the place of each press.
    reference
        (n_meas,) V of the untouched skin, where it is known.
    noise
        (n_meas,) V of dv, where it was measured.

    Raises
    ------
    DataError
        For arrays that do not belong together, labels outside the skin, data that never change.
    """
    region = Region.of(skin)
    presses = _checked(Presses.of_more(dv, xy).within(region), skin)
    grid = region.metres(region.grid * 0.95)
    grid = grid[:: max(len(grid) // _ASKED, 1)]
    progress(0, 3)
    sheet = IndentationResponses.of(skin, np.vstack([presses.xy, grid]))
    progress(1, 3)
    n = len(presses)
    here = replace(sheet, positions=presses.xy, changes=sheet.changes[:, :n])
    there = replace(sheet, positions=grid, changes=sheet.changes[:, n:])
    sign = {"decrease": (1.0,), "increase": (-1.0,)}.get(skin.touch.sign, (1.0, -1.0))
    sd = quiet_noise(presses.dv) if noise is None else noise
    evidence = MappingLikelihood(here, presses.dv, sd, reference, sign, _WORTH)
    signed = len(sign) == 1 or reference is not None
    scores = _searched(evidence, ring_of(skin), signed)
    progress(2, 3)
    answer = _weighed(scores, there, sd, signed, n)
    contradicted = _contradicted(evidence, there, answer.mapping)
    progress(3, 3)
    return replace(answer, contradicted=contradicted)


def _checked(presses: Presses, skin: Skin) -> Presses:
    if presses.dv.shape[1] != skin.pattern().n_meas:
        raise DataError(f"expected {skin.pattern().n_meas} rows of dv, got {presses.dv.shape[1]}")
    silent = np.flatnonzero(np.nansum(np.abs(presses.dv), axis=1) == 0)
    if len(silent):
        raise DataError(
            "expected presses that change the voltages, got no change", where=f"press {silent[0]}"
        )
    return presses


def _searched(
    evidence: MappingLikelihood, ring: tuple[int, ...], signed: bool
) -> dict[ChannelMapping, float]:
    """Log-probability of the mappings that were looked at, prior included, not normalised."""
    polarities = (False, True) if signed else (False,)
    frontier = [replace(w, reversed=r) for w in turns(ring) for r in polarities]
    searched: dict[ChannelMapping, float] = {}
    each = np.log((1 - _SWAPPED) / len(frontier))
    pairs = len(ring) * (len(ring) - 1) / 2
    for _ in range(1 + _MOST_SWAPS):
        fresh = [w for w in dict.fromkeys(frontier) if w not in searched]
        scores = (each + evidence(fresh)).tolist() if fresh else []
        searched.update(zip(fresh, scores, strict=True))
        best = sorted(fresh, key=lambda w: -searched[w])[: max(int(_TRIED / pairs), 6)]
        frontier = list(chain.from_iterable(swaps(w) for w in best))
        each += np.log(_SWAPPED / pairs)
    return searched


def _weighed(
    scores: dict[ChannelMapping, float],
    there: IndentationResponses,
    noise: FloatArray,
    signed: bool,
    presses: int,
) -> MappingAnswer:
    """The likeliest, with those that no press at all could tell from it."""
    ranked = sorted(scores, key=lambda w: -scores[w])
    weights = np.exp(np.array([scores[w] for w in ranked]) - scores[ranked[0]])
    nothing = np.exp(np.log(_NOTHING) - scores[ranked[0]])
    total = weights.sum() + nothing
    best, mine = ranked[0], float(weights[0])
    answers = there.rows([best], there.changes[0])[0]
    faint = 0.02 * float(np.median(np.abs(answers))) * noise / np.median(noise)
    second, place, odds = ranked[1], there.positions[0], float("inf")
    for mapping, weight in zip(ranked[1:], weights[1:].tolist(), strict=True):
        others = there.rows([mapping], there.changes[0])[0]
        same = agreement(answers, others, faint)
        same = same * (1 if mapping.reversed == best.reversed else -1)
        if same.min() > _ALIKE:
            mine += weight
            continue
        second, odds = mapping, mine / max(weight, 1e-300)
        place = there.positions[int(np.argmin(same))]
        break
    unexplained, sure = float(nothing / total), float(mine / total)
    return MappingAnswer(presses, best, sure, second, odds, unexplained, signed, place, ())


def _contradicted(
    evidence: MappingLikelihood, there: IndentationResponses, mapping: ChannelMapping
) -> tuple[tuple[int, float, float], ...]:
    """Presses that fit far better at another place than at their label."""
    extent = float(np.ptp(there.positions, axis=0).max())
    labelled = evidence.sheet.rows([mapping], evidence.sheet.changes)[0]
    elsewhere = there.rows([mapping], there.changes)[0]
    fits = np.array(evidence.signs)[:, None] * (-1.0 if mapping.reversed else 1.0)
    remarks = []
    for row, dv in enumerate(evidence.dv):
        mine = (fits * agreement(dv, labelled[:, row], evidence.noise)).max()
        other = (fits[..., None] * agreement(dv, elsewhere, evidence.noise)).max(axis=(0, 1))
        best = int(np.argmax(other))
        gain = likelihood(other[best], evidence.worth) - likelihood(mine, evidence.worth)
        gap = np.linalg.norm(there.positions[best] - evidence.sheet.positions[row])
        if gain > _ELSEWHERE and gap > _FAR * extent:
            remarks.append((row, *there.positions[best].tolist()))
    return tuple(remarks)
