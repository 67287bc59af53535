"""What a material remembers, identified from a recording of its load and its response."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import nnls

from tomoskin.core import DataError, FloatArray
from tomoskin.model.skin import MaterialMemory, MemoryState, advanced, responses

_WHERE = "identify"
_FEWEST = 10
_ROUNDS = 60
_ENOUGH = 1e-6
"""Part of the squared residual by which a round must gain, or it is the last."""

_WEIGHTLESS = 1e-4
"""A part below this one of the whole response is left out."""


@dataclass(frozen=True)
class MaterialFit:
    """A ``memory`` and its ``gauge``: response per load. ``residual`` is the root mean square of
    what they leave of the response, in its unit."""

    memory: MaterialMemory
    gauge: float
    residual: float

    def predicted(self, time: ArrayLike, load: ArrayLike) -> FloatArray:
        """(n,) responses to ``load`` (n,) at ``time`` (n,) s, from a material never loaded."""
        times, loads = (np.asarray(values, dtype=np.float64) for values in (time, load))
        return responses(self.memory, times, loads, self.gauge)


def identify(
    time: ArrayLike,
    load: ArrayLike,
    answer: ArrayLike,
    *,
    widths: Sequence[float] = (),
    times: Sequence[float] = (),
    breakdown_times: Sequence[float] = (),
) -> MaterialFit:
    """The memory that is nearest to a recording of a material that had never been loaded.

    Widths and times are given, as many as may be needed; which of them count, and by how much, is
    found by least squares in which nothing is negative (Lawson & Hanson 1974, chapter 23), for
    plays with breakdown and for creep in turn. Parts that do not count are left out.

    Parameters
    ----------
    time, load, answer
        (n,) s; in any unit; in any unit, 0 without load.
    widths
        Half widths of plays, in the unit of the load.
    times, breakdown_times
        Time constants of creep and of breakdown, s.

    Raises
    ------
    DataError
        For shapes that do not belong together, values that are not finite, times that go back,
        fewer than ten values, or a load that never changes.
    ModelError
        When a width or a time is not above 0.
    """
    t, x, y = _checked(time, load, answer)
    grid = MaterialMemory(
        play=(0.0,) * len(widths),
        play_widths=tuple(widths),
        creep=(0.0,) * len(times),
        creep_times=tuple(times),
        breakdown=(0.0,) * len(breakdown_times),
        breakdown_times=tuple(breakdown_times),
    )
    series = _Series.of(grid, t, x)
    size = float(np.sqrt((y**2).mean())) or 1.0
    creep, last = np.zeros(len(times)), np.inf
    for _ in range(_ROUNDS):
        plays, broken = series.without_creep(creep, y / size)
        creep, residual = series.with_plays(plays, broken, y / size)
        if last - residual < _ENOUGH * len(y):
            break
        last = residual
    memory, gauge = _named(grid, size * plays, creep, size * broken)
    left_over = responses(memory, t, x, gauge) - y
    return MaterialFit(memory, gauge, float(np.sqrt((left_over**2).mean())))


@dataclass(frozen=True, eq=False)
class _Series:
    """What each part of a memory answers over a recording, whatever its weight.

    ``prompt`` (1 + n_play, n): the load, then each play; ``late`` (n_creep, 1 + n_play, n) these,
    late; ``broken`` (n_breakdown, n).
    """

    prompt: FloatArray
    late: FloatArray
    broken: FloatArray

    @classmethod
    def of(cls, grid: MaterialMemory, time: FloatArray, load: FloatArray) -> _Series:
        n_play, n_late, n_broken = map(len, (grid.play, grid.creep, grid.breakdown))
        prompt = np.empty((1 + n_play, len(load)))
        late = np.empty((n_late, 1 + n_play, len(load)))
        broken = np.empty((n_broken, len(load)))
        kept = MemoryState.fresh(grid)
        slow, motion = np.zeros((n_late, 1 + n_play)), np.zeros(n_broken)
        steps = np.diff(time, prepend=time[0]).tolist()
        for k, step in enumerate(steps):
            # The load before stood until now: what was late has come nearer to it.
            late_kept, broken_kept = grid.kept(step)
            if k:
                slow = prompt[:, k - 1] + (slow - prompt[:, k - 1]) * late_kept[:, None]
            before = float(kept.load[0, 0])
            kept = advanced(kept, grid, np.array([[load[k]]]), 0.0)
            motion = motion * broken_kept + abs(load[k] - before)
            prompt[0, k], prompt[1:, k] = load[k], kept.lagging[:, 0, 0]
            late[:, :, k], broken[:, k] = slow, motion
        return cls(prompt, late, broken)

    def without_creep(self, creep: FloatArray, y: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Weights of load and plays, and of breakdown, given those of creep."""
        basis = (1 - creep.sum()) * self.prompt + np.tensordot(creep, self.late, 1)
        weights, _ = nnls(np.concatenate([basis, self.broken]).T, y)
        return weights[: len(self.prompt)], weights[len(self.prompt) :]

    def with_plays(
        self, plays: FloatArray, broken: FloatArray, y: FloatArray
    ) -> tuple[FloatArray, float]:
        """Weights of creep given those of plays and breakdown; the squared residual."""
        prompt = plays @ self.prompt
        rest = y - prompt - broken @ self.broken
        basis = np.einsum("p,cpn->cn", plays, self.late) - prompt
        if not len(basis):
            return np.zeros(0), float(rest @ rest)
        weights, _ = nnls(basis.T, rest)
        weights /= max(1.0, weights.sum())
        residual = rest - weights @ basis
        return weights, float(residual @ residual)


def _named(
    grid: MaterialMemory, plays: FloatArray, creep: FloatArray, broken: FloatArray
) -> tuple[MaterialMemory, float]:
    """The memory of these weights, without parts that do not count; its gauge."""
    gauge = float(plays.sum())
    if not gauge > 0:
        raise DataError(
            "the response does not rise with the load, so no memory of the material can be "
            "identified",
            where=_WHERE,
            hint="change the sign of the response, and check its value without load",
        )
    parts = (plays[1:] / gauge, creep, broken / gauge)
    sizes = (grid.play_widths, grid.creep_times, grid.breakdown_times)
    kept = [
        [(float(w), s) for w, s in zip(weights, lengths, strict=True) if w > _WEIGHTLESS]
        for weights, lengths in zip(parts, sizes, strict=True)
    ]
    (play, creeping, breaking) = [tuple(zip(*pairs, strict=True)) or ((), ()) for pairs in kept]
    return MaterialMemory(*play, *creeping, *breaking), gauge


def _checked(
    time: ArrayLike, load: ArrayLike, answer: ArrayLike
) -> tuple[FloatArray, FloatArray, FloatArray]:
    t, x, y = (np.asarray(values, dtype=np.float64) for values in (time, load, answer))
    if t.ndim != 1 or not t.shape == x.shape == y.shape or len(t) < _FEWEST:
        raise DataError(
            f"expected time, load and response of the same length, at least {_FEWEST}, got "
            f"shapes {t.shape}, {x.shape}, {y.shape}",
            where=_WHERE,
        )
    for name, values in (("time", t), ("load", x), ("response", y)):
        wrong = np.flatnonzero(~np.isfinite(values))
        if len(wrong):
            raise DataError(f"the {name} is not finite at value {wrong[0]}", where=_WHERE)
    if (np.diff(t) < 0).any():
        back = int(np.argmax(np.diff(t) < 0)) + 1
        raise DataError(f"the time decreases at value {back}", where=_WHERE)
    if np.ptp(x) == 0:
        raise DataError("the load never changes, so nothing can be learnt", where=_WHERE)
    return t, x, y
