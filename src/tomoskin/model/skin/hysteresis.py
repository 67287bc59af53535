"""What a conductive material remembers of its load: play, creep, and a network broken by motion.

One model for what simulates a sheet and for what reads it: :func:`advanced` goes from loads to
responses, :func:`load_of` back, one step at a time, each from the state before to the state after.

- **Play** (Prandtl & Ishlinskii; Krasnosel'skii & Pokrovskii 1989, chapter 1): a part of the
  response follows the load only when that has moved on by a half width. Time changes nothing.
- **Creep**: a part of the response comes late, q' = (s − q)/τ (Prony series).
- **Breakdown**: any motion of the load, either way, breaks contacts between conductive particles,
  b grows by |Δload|, and they form again, b' = −b/τ: filled elastomers rise in resistance when
  they are stretched and once more when they are released (Payne 1962; Yamaguchi, Busfield & Thomas
  2003, J. Polym. Sci. B 41, 2079).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Self

import numpy as np

from tomoskin.core import FloatArray, IntArray, ModelError

_WHERE = "MaterialMemory"


@dataclass(frozen=True)
class MaterialMemory:
    """Parts of a response that depend on the past of its load; without any, there is no memory.

    Attributes
    ----------
    play, play_widths
        Parts that lag behind by a play, and the plays' half widths in the unit of the load.
    creep, creep_times
        Parts that come late, and their time constants, s.
    breakdown, breakdown_times
        Response per motion of the load either way, and the time constants, s, with which it goes.

    Raises
    ------
    ModelError
        When parts and sizes differ in number, a size is not above 0, parts of play or creep are
        negative or add up to more than 1, or a breakdown is negative.
    """

    play: tuple[float, ...] = ()
    play_widths: tuple[float, ...] = ()
    creep: tuple[float, ...] = ()
    creep_times: tuple[float, ...] = ()
    breakdown: tuple[float, ...] = ()
    breakdown_times: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        """Check the strengths, widths and times of each series."""
        for parts, sizes, most in (
            ("play", "play_widths", 1.0),
            ("creep", "creep_times", 1.0),
            ("breakdown", "breakdown_times", math.inf),
        ):
            _check_series(parts, getattr(self, parts), sizes, getattr(self, sizes), most)

    @property
    def still(self) -> bool:
        """Whether time alone changes nothing."""
        return not (self.creep or self.breakdown)

    @cached_property
    def half_widths(self) -> FloatArray:
        """Half widths (n_play, 1) of the play operators."""
        return np.array(self.play_widths).reshape(-1, 1)

    def kept(self, dt: float) -> tuple[FloatArray, FloatArray]:
        """Parts of late responses, and of breakdowns, that are left after ``dt`` s."""
        return (
            np.exp(-dt / np.array(self.creep_times)),
            np.exp(-dt / np.array(self.breakdown_times)),
        )


def _check_series(
    parts: str, weights: Sequence[float], sizes: str, lengths: Sequence[float], most: float
) -> None:
    if len(weights) != len(lengths):
        raise ModelError(
            f"expected as many {parts} as {sizes}, got {len(weights)} and {len(lengths)}",
            where=_WHERE,
        )
    if not all(0 < length < math.inf for length in lengths):
        raise ModelError(f"expected {sizes} above 0, got {tuple(lengths)}", where=_WHERE)
    if not (all(0 <= w < math.inf for w in weights) and sum(weights) <= most):
        limit = "" if most == math.inf else f" to a sum of {most:g}"
        raise ModelError(f"expected {parts} from 0{limit}, got {tuple(weights)}", where=_WHERE)


@dataclass(frozen=True, slots=True)
class Metric:
    """How large a load of several components is: groups of components that a play takes as one.

    ``weights`` has a tuple for each group, in the order of the components: a group's size is
    √(Σ weight · component²).
    """

    weights: tuple[tuple[float, ...], ...] = ((1.0,),)

    def sizes(self, components: FloatArray) -> FloatArray:
        """(…, n_groups, n) sizes of ``components`` (…, d, n)."""
        if self._each_alone:
            return np.abs(components)
        sizes, start = [], 0
        for group in self.weights:
            part = components[..., start : start + len(group), :]
            square = part * part
            square *= np.array(group)[:, None]
            sizes.append(np.sqrt(square.sum(axis=-2)))
            start += len(group)
        return np.stack(sizes, axis=-2)

    def dragged(self, lagging: FloatArray, load: FloatArray, width: FloatArray) -> FloatArray:
        """(n_play, d, n): ``lagging`` plays of half widths ``width`` (n_play, 1) behind ``load``
        (d, n)."""
        if self._each_alone:
            half = width[:, None]
            return np.minimum(np.maximum(lagging, load - half), load + half)
        slack = lagging - load
        start, sizes = 0, self.sizes(slack)
        for number, group in enumerate(self.weights):
            size = sizes[:, number]
            slack[:, start : start + len(group)] *= (width / np.maximum(size, width))[:, None]
            start += len(group)
        slack += load
        return slack

    @property
    def _each_alone(self) -> bool:
        return set(self.weights) == {(1.0,)}


SCALAR = Metric()
"""Of loads that are one number each."""


@dataclass(frozen=True, eq=False)
class MemoryState:
    """What ``n`` pieces of a material remember, for loads of ``d`` components.

    Attributes
    ----------
    load
        (d, n) as it was last.
    lagging
        (n_play, d, n) where each play stands.
    late
        (n_creep, d, n) what each late part has reached.
    broken
        (n_breakdown, n_groups, n) motion of which the material has not recovered.
    """

    load: FloatArray
    lagging: FloatArray
    late: FloatArray
    broken: FloatArray

    @classmethod
    def fresh(cls, memory: MaterialMemory, n: int = 1, metric: Metric = SCALAR) -> Self:
        """A material that has never been loaded."""
        d = sum(map(len, metric.weights))
        return cls(
            load=np.zeros((d, n)),
            lagging=np.zeros((len(memory.play), d, n)),
            late=np.zeros((len(memory.creep), d, n)),
            broken=np.zeros((len(memory.breakdown), len(metric.weights), n)),
        )

    def of_pieces(self, which: IntArray) -> MemoryState:
        """What the pieces ``which`` (k,) remember, in that order."""
        return MemoryState(*(part[..., which] for part in self._parts))

    def joined(self, others: MemoryState) -> MemoryState:
        """What these pieces remember, and then the ``others``."""
        pairs = zip(self._parts, others._parts, strict=True)
        return MemoryState(*(np.concatenate(pair, axis=-1) for pair in pairs))

    @property
    def _parts(self) -> tuple[FloatArray, ...]:
        return self.load, self.lagging, self.late, self.broken


def check_step(dt: float) -> None:
    """Raise ModelError unless ``dt`` s is a step of time."""
    if not 0 <= dt < math.inf:
        raise ModelError(f"expected a time step of 0 s or more, got {dt}", where=_WHERE)


def advanced(
    state: MemoryState,
    memory: MaterialMemory,
    load: FloatArray,
    dt: float,
    metric: Metric = SCALAR,
) -> MemoryState:
    """The state after ``load`` (d, n) has stood for ``dt`` s; exact for any length of the step.

    The load is taken to jump at the start of the step, along a straight line.

    Raises
    ------
    ModelError
        When dt is negative or not finite.
    """
    check_step(dt)
    lagging, late, broken = state.lagging, state.late, state.broken
    if memory.play:
        lagging = metric.dragged(lagging, load, memory.half_widths)
    if memory.creep:
        prompt = _mixed(load, lagging, memory.play)
        late = late - prompt
        late *= memory.kept(dt)[0].reshape(-1, 1, 1)
        late += prompt
    if memory.breakdown:
        moved = metric.sizes(load - state.load)
        broken = (broken + moved) * memory.kept(dt)[1].reshape(-1, 1, 1)
    return MemoryState(load, lagging, late, broken)


def followed(state: MemoryState, memory: MaterialMemory) -> FloatArray:
    """(d, n) part of the response that follows the load, with its plays and creep."""
    prompt = _mixed(state.load, state.lagging, memory.play)
    return _mixed(prompt, state.late, memory.creep)


def broken_down(state: MemoryState, memory: MaterialMemory) -> FloatArray:
    """(n_groups, n) part of the response that motion has caused."""
    return np.asarray(np.tensordot(np.array(memory.breakdown), state.broken, 1))


def load_of(
    state: MemoryState, memory: MaterialMemory, answer: FloatArray, dt: float
) -> tuple[FloatArray, MemoryState]:
    """The load (n,) that makes the response ``answer`` (n,) after ``dt`` s, and the state then.

    The inverse of :func:`advanced` and :func:`followed`, exact: the response is a line in pieces
    of the new load, with a bend where a play begins to be pulled. The memory has no breakdown.

    Raises
    ------
    ModelError
        When dt is negative or not finite.
    """
    width, lagging = memory.half_widths, state.lagging[:, 0]
    bends = np.sort(np.concatenate([state.load, lagging - width, lagging + width]), axis=0)
    ends = np.concatenate([bends[:1] - 1.0, bends, bends[-1:] + 1.0])
    each = Metric(((1.0,),) * len(ends))  # trials take the place of components
    values = followed(advanced(state, memory, ends, dt, each), memory)
    piece = (values[1:-1] <= answer).sum(axis=0)
    column = np.arange(len(answer))
    low, high = values[piece, column], values[piece + 1, column]
    part = (answer - low) / np.where(high > low, high - low, 1.0)
    first = ends[piece, column]
    load = first + part * (ends[piece + 1, column] - first)
    return load, advanced(state, memory, load[None], dt)


def _mixed(load: FloatArray, parts: FloatArray, weights: tuple[float, ...]) -> FloatArray:
    """(d, n): ``parts`` (n_parts, d, n) by their weights, and of ``load`` what these leave."""
    if not weights:
        return load
    total = (1 - sum(weights)) * load
    for weight, part in zip(weights, parts, strict=True):
        total += weight * part
    return np.asarray(total)
