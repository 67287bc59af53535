"""A recorded motion, and what a body that moves does to the voltages: a smooth manifold over its
state, what the sheet remembers, and what is left over."""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike
from threadpoolctl import threadpool_limits

from tomoskin.core import DataError, FloatArray, IntArray
from tomoskin.sensing.fit import Whitener

_LEAST = 6
"""Frames of a moved body from which something can be learnt."""

_SAME = 1e-6
"""A coordinate that is below this is at rest."""

MOST_COORDINATES = 3

TENSOR = ("curvature", "deviator xx", "deviator xy")
"""Coordinates of a bend whose axis is not known: angle · (1, cos 2a, sin 2a)."""


@dataclass(frozen=True, eq=False)
class BodyExamples:
    """Frames of a body that moves, in the order of their times, nothing touching.

    Attributes
    ----------
    dv
        (n, n_meas) V minus the skin at rest.
    time
        (n,) s, ascending.
    state
        (n, d) coordinates of the body, 0 at rest, d from 1 to 3. Without a column where nothing
        has measured them.
    names
        (d,) what the coordinates are. A name that begins with "angle" is in rad.
    axis
        Rad from u, of a bend that has one axis only.
    """

    dv: FloatArray
    time: FloatArray
    state: FloatArray
    names: tuple[str, ...]
    axis: FloatArray

    @classmethod
    def checked(
        cls,
        dv: ArrayLike,
        time: ArrayLike,
        *,
        state: FloatArray | None = None,
        names: tuple[str, ...] = (),
        axis: FloatArray | None = None,
        angle: FloatArray | None = None,
    ) -> Self:
        """Check the frames and their states.

        Instead of ``state``, ``angle`` (n,) rad may say how the body is bent, and then ``axis``
        (n,) rad from u about which, a direction without a sense.

        Raises
        ------
        DataError
            For arrays that do not belong together, times that do not go on, fewer than six moved
            frames, a coordinate that does not move, or more than three coordinates.
        """
        data, times = np.asarray(dv, dtype=np.float64), np.asarray(time, dtype=np.float64)
        about = np.asarray(np.pi / 2 if axis is None else axis, dtype=np.float64)
        if angle is not None:
            names, state, about = _of_bends(np.asarray(angle, dtype=np.float64), about)
        values = np.zeros((len(data), 0)) if state is None else np.asarray(state, np.float64)
        if data.ndim != 2 or times.shape != (len(data),) or values.shape != (len(data), len(names)):
            shapes = ", ".join(str(a.shape) for a in (data, times, values))
            raise DataError(
                "expected (n, n_meas) frames, (n,) times and (n, d) states with d names, got "
                f"{shapes} and {len(names)} names"
            )
        if not all(np.isfinite(a).all() for a in (data, times, values)):
            raise DataError(
                "expected finite frames, times and states, got values that are not finite"
            )
        if not (np.diff(times) > 0).all():
            raise DataError(
                "expected frames in the order of their times, got a time that does not increase"
            )
        _check_moves(values, names)
        return cls(data, times, values, names, about)

    @cached_property
    def size(self) -> FloatArray:
        """(d,) the largest of each coordinate."""
        return np.asarray(np.abs(self.state).max(axis=0))

    @property
    def turns(self) -> bool:
        """Whether the axis of a bend is among the coordinates."""
        return self.names == TENSOR


def _of_bends(
    angle: FloatArray, axis: FloatArray
) -> tuple[tuple[str, ...], FloatArray, FloatArray]:
    """Names, state and axis of a bend: its angle about one axis, or angle · (1, cos 2a, sin 2a)
    where there are three axes a or more.

    These are the curvature's trace and deviator, in which small bends' voltages are linear.
    """
    axis = np.broadcast_to(axis, angle.shape) if axis.ndim == 0 else axis
    if angle.ndim != 1 or angle.shape != axis.shape:
        raise DataError(f"expected (n,) labels, got {angle.shape} angles and {axis.shape} axes")
    bent = np.abs(angle) > _SAME
    axes = np.mod(axis[bent], np.pi)
    if len(np.unique(axes.round(5))) < 3:
        return ("angle",), angle[:, None], axes[:1].sum()
    parts = np.column_stack([np.ones_like(axis), np.cos(2 * axis), np.sin(2 * axis)])
    return TENSOR, angle[:, None] * parts, np.zeros(())


def _check_moves(values: FloatArray, names: tuple[str, ...]) -> None:
    if len(names) > MOST_COORDINATES:
        raise DataError(
            f"expected at most {MOST_COORDINATES} coordinates of a body, got {len(names)}"
        )
    moved = np.abs(values) > _SAME
    if values.shape[1] and np.count_nonzero(moved.any(axis=1)) < _LEAST:
        raise DataError(
            f"expected the body at rest and at least {_LEAST} moved frames, got "
            f"{np.count_nonzero(moved.any(axis=1))} moved frames",
            hint="move the body through what it will do, and back",
        )
    for name, column in zip(names, values.T, strict=True):
        if len(np.unique(column)) < 3:
            raise DataError(
                f"expected the body at rest and at two or more values of {name}, got "
                f"{len(np.unique(column))} values",
                hint="move the body through what it will do, and back",
            )


_WIDTHS = (0.02, 0.03, 0.045, 0.065, 0.1, 0.15, 0.22, 0.33)
"""Half widths of a play, in parts of the largest of a coordinate, among which the data choose."""

_LAGS = (1.0, 30.0)
"""Time constants of what comes late, s."""

_DEGREES = (1, 2, 3)
"""Of the polynomials in the state, among which the data choose."""


class Memory:
    """Features of states x (d,), in parts of the largest: powers, and where it has plays what the
    sheet remembers, alone and together with the state of the moment.

    What a sheet does late is a sum of plays and low passes of its strain (Krejčí & Kuhnen 2001,
    IEE Proc. Control Theory Appl. 148, 185). Strain is a vector, and its play is dragged as a
    whole where it lags by more than its width: what one coordinate does takes along what another
    has left behind. Where one coordinate alone strains the sheet, its play is its own.

    Parameters
    ----------
    degree
        The highest power.
    widths
        (p, d) half widths of the plays, infinite for coordinates that do not count in one; without
        a row, nothing is remembered.
    before
        (n, d) states that the sheet went through before its reference.
    """

    def __init__(self, degree: int, widths: FloatArray, before: FloatArray) -> None:
        self._degree, self._widths, self._time = degree, widths, np.inf
        self._lags = np.array(_LAGS if len(widths) else ())[:, None]
        self._late = 0.0 * self._lags * before[0]
        self._plays = self._start = np.zeros_like(widths)
        for row in (*before, 0.0 * before[0]):
            self._plays = self._after(row[None], 0.0)[0][0]
        self._start = self._plays

    def features(self, x: FloatArray, time: float) -> FloatArray:
        """(n, f) features of states ``x`` (n, d), any of which may be at ``time`` s; all 0 at
        rest."""
        return joined(self._degree, x, *self._past(*self._after(x, time)))

    def push(self, x: FloatArray, time: float) -> tuple[FloatArray, FloatArray]:
        """Take the state ``x`` (d,) that was at ``time`` s; frames in order."""
        plays, late = self._after(x[None], time)
        self._plays, self._late, self._time = plays[0], late[0], time
        return self._plays, self._late

    def over(self, x: FloatArray, time: FloatArray) -> tuple[FloatArray, FloatArray]:
        """(n, p) plays since the reference and (n, l) low passes over a whole recording (n, d),
        from its rest on."""
        steps = [self.push(row, now) for row, now in zip(x, time.tolist(), strict=True)]
        return self._past(*map(np.array, zip(*steps, strict=True)))

    def _after(self, x: FloatArray, time: float) -> tuple[FloatArray, FloatArray]:
        now, kept = x[:, None], np.exp(-max(time - self._time, 0.0) / self._lags)
        away = now - self._plays
        size = np.sqrt(np.sum((away / self._widths) ** 2, axis=2, keepdims=True))
        return now - away / np.maximum(size, 1.0), now + (self._late - now) * kept

    def _past(self, plays: FloatArray, late: FloatArray) -> tuple[FloatArray, FloatArray]:
        return (plays - self._start)[:, np.isfinite(self._widths)], late.reshape(len(late), -1)


def joined(degree: int, x: FloatArray, *past: FloatArray) -> FloatArray:
    """(n, f) features of states ``x`` (n, d) and of their ``past``, each (n, k)."""
    powers = (
        x[:, chosen].prod(axis=1)
        for power in range(1, degree + 1)
        for chosen in map(list, itertools.combinations_with_replacement(range(x.shape[1]), power))
    )
    late = np.hstack(past)
    return np.column_stack([*powers, late, *(one[:, None] * late for one in x.T)])


def plays_of(widths: FloatArray) -> FloatArray:
    """(p, d) half widths of the play of all coordinates together, and of each alone."""
    alone = np.where(np.eye(len(widths), dtype=bool), widths, np.inf)
    return np.vstack([widths, alone]) if len(widths) > 1 else alone


_ABOVE = 1.1
"""A direction counts above so many times the edge of noise."""

_MOST = 8

_WORTH = 0.9
"""More features count where squared errors of left-out frames fall to this part by them."""

_SLOPE = 1e-3
"""Step of a slope, in parts of a coordinate's largest."""

_ODD = 5.0
"""Frames are odd that are missed by so many times the median."""

_DOUBTED, _SAYS_NOTHING = 0.3, 1.0
"""Error of left-out states, in parts of their scatter, from which they are doubted, or refused."""

_FEW = 0.03
"""Part of the frames that may be odd: a sheet that remembers has some at the turns."""

_FOLDS = 5
_RIDGES = np.geomspace(1e-6, 1.0, 13)


@dataclass(frozen=True, eq=False)
class BodyModel:
    """What a body does to the data of a skin, over its state; made by :meth:`learn`.

    Attributes
    ----------
    examples
        What it was learnt from.
    body
        The same; with amplitudes of the data for a state where nothing measured it.
    covariance
        (n_meas, n_meas) V² of one frame less the reference.
    directions
        (n_meas, k) V: where the body moves the data, orthonormal in units of the noise.
    degree, widths
        Of the polynomials, and (p, d) of the plays of :class:`Memory`: none where the sheet's past
        does not count.
    weights
        (f, k) from features (:class:`Memory`) to amplitudes of the directions.
    errors
        (n, k) by which amplitudes are missed when their part of the recording is left out.
    """

    examples: BodyExamples
    body: BodyExamples
    covariance: FloatArray
    directions: FloatArray
    degree: int
    widths: FloatArray
    weights: FloatArray
    errors: FloatArray

    @classmethod
    def learn(cls, examples: BodyExamples, covariance: FloatArray) -> Self:
        """From frames that nothing touches.

        Directions are the principal ones of the whitened frames above the edge of noise
        (Marchenko & Pastur 1967). Amplitudes are a ridge regression on features of the state.
        Its degree, whether the past counts, and the ridge are what errs least on left-out fifths
        of the recording. A sheet that remembers is taken to have moved so before its reference
        was taken, as it will have whenever it is used. Without measured states the leading
        amplitudes are the state, as few of them as explain the others.

        Raises
        ------
        DataError
            When the motion does not show above the noise, or the covariance is of other rows.
        """
        n_meas = examples.dv.shape[1]
        if covariance.shape != (n_meas, n_meas):
            raise DataError(f"expected {n_meas} rows of covariance, got shape {covariance.shape}")
        whiten = Whitener.of(covariance)
        whitened = whiten(examples.dv)
        _, singular, rows = np.linalg.svd(whitened, full_matrices=False)
        edge = np.sqrt(whitened.shape[1]) + np.sqrt(len(whitened))
        count = min(int(np.count_nonzero(singular > _ABOVE * edge)), _MOST)
        if count == 0:
            raise DataError(
                "the changes by the motion are not larger than the noise",
                hint="move the body farther, or check that the states belong to these frames",
            )
        directions = np.linalg.pinv(whiten.matrix) @ rows[:count].T
        z = whitened @ rows[:count].T
        with threadpool_limits(1):  # small products: in a crowded machine threads wait tenfold
            fits = [(one, *fit) for one in _with_states(examples, z) for fit in _fits(one, z)]
        body, *best = fits[0]
        for one, *fit in fits[1:]:
            if _missed(fit[-1]) < _WORTH * _missed(best[-1]):
                body, best = one, fit
        return cls(examples, body, covariance, directions, *best)

    def without(self, rows: IntArray) -> BodyModel:
        """Learnt again from the rows that are left without ``rows`` (k,), indices.

        Raises DataError when the motion does not show in these.
        """
        kept = np.delete(np.arange(len(self.covariance)), rows)
        examples = replace(self.examples, dv=self.examples.dv[:, kept])
        return self.learn(examples, self.covariance[np.ix_(kept, kept)])

    @property
    def remembers(self) -> bool:
        """Whether the sheet's past counts."""
        return len(self.widths) > 0

    def memory(self) -> Memory:
        """Of a sheet at its reference."""
        return Memory(self.degree, self.widths, self.body.state / self.body.size)

    @property
    def n_modes(self) -> int:
        """The number of directions in which the body moves the data."""
        return int(self.directions.shape[1])

    @cached_property
    def whiten(self) -> Whitener:
        """The transform that makes the noise white."""
        return Whitener.of(self.covariance)

    @cached_property
    def excess(self) -> FloatArray:
        """(k, k) of the errors beyond the noise of a frame."""
        scatter = self.errors.T @ self.errors / max(len(self.errors) - self.n_modes - 1, 1)
        values, vectors = np.linalg.eigh(scatter - np.eye(self.n_modes))
        return np.asarray(vectors * np.maximum(values, 0.0) @ vectors.T)

    def expanded(self, memory: Memory, x: FloatArray, time: float) -> tuple[FloatArray, FloatArray]:
        """(k,) amplitudes at a state ``x`` (d,), in parts of the largest, and slopes (k, d)."""
        ends = np.vstack([x, x + _SLOPE * np.eye(len(x))])
        rows = memory.features(ends, time) @ self.weights
        return rows[0], ((rows[1:] - rows[0]) / _SLOPE).T

    @cached_property
    def error(self) -> FloatArray:
        """(d,) root mean square by which left-out states are missed, each in its unit."""
        memory, total = self.memory(), np.zeros(len(self.body.names))
        weights = np.linalg.inv(self.excess + np.eye(self.n_modes))
        course = zip(self.body.state / self.body.size, self.body.time, self.errors, strict=True)
        for x, time, error in course:
            slopes = self.expanded(memory, x, float(time))[1]
            memory.push(x, float(time))
            total += (np.linalg.pinv(slopes.T @ weights @ slopes) @ slopes.T @ weights @ error) ** 2
        return np.asarray(self.body.size * np.sqrt(total / len(self.errors)))

    def doubts(self) -> list[str]:
        """What is wrong with the states of the examples, in sentences.

        Raises DataError where left-out frames tell no more of a state than its mean does.
        """
        if not self.examples.names:
            return []
        missed = self.error / self.body.state.std(axis=0)
        worst = int(missed.argmax())
        text = (
            f"the voltages do not follow the states: those of {self.body.names[worst]} that were "
            f"left out are missed by {missed[worst]:.1f} times their own scatter"
        )
        advice = "check that the states are of these frames, in time and order, and of this body"
        if not missed[worst] < _SAYS_NOTHING:
            raise DataError(f"{text}, expected less than {_SAYS_NOTHING:g}", hint=advice)
        said = [f"{text}; {advice}"] if missed[worst] > _DOUBTED else []
        away = np.linalg.norm(self.errors, axis=1)
        odd = np.flatnonzero(away > _ODD * max(float(np.median(away)), np.sqrt(self.n_modes)))
        if len(odd) > _FEW * len(away):
            said.append(
                f"in {len(odd)} of {len(away)} frames, first in frame {odd[0]}, the voltages do "
                "not follow the states: an encoder has stopped or jumped, or something touched. "
                "Touches are separated all the same; states are less certain, which their "
                "deviations say"
            )
        return said

    def changes(self, state: FloatArray, time: FloatArray) -> FloatArray:
        """(n, n_meas) V that the body adds to the reference in a course of states (n, d) at
        ``time`` (n,) s, from rest on: where an encoder tells them."""
        x = state / self.body.size
        features = joined(self.degree, x, *self.memory().over(x, time))
        return np.asarray(features @ self.weights @ self.directions.T)


def _with_states(examples: BodyExamples, z: FloatArray) -> Iterator[BodyExamples]:
    """The examples themselves; without states, with one to three leading amplitudes ``z``."""
    if examples.names:
        yield examples
        return
    for count in range(1, min(MOST_COORDINATES, z.shape[1]) + 1):
        names = tuple(f"latent {k + 1}" for k in range(count))
        yield replace(examples, state=z[:, :count], names=names)


def _missed(errors: FloatArray) -> float:
    """Mean square of ``errors`` (n, k), of each amplitude at least the noise's: one that is the
    state itself is missed by nothing."""
    return float(np.maximum(np.mean(errors**2, axis=0), 1.0).mean())


def _fits(examples: BodyExamples, z: FloatArray) -> Iterator[tuple[Any, ...]]:
    """Degree, widths of plays, weights and left-out errors: without a memory, and with one."""
    x, time = examples.state / examples.size, examples.time
    widths = plays_of(_widths(x, time, z))
    pasts = [(one, *Memory(1, one, x).over(x, time)) for one in (widths[:0], widths)]
    for degree, (own, *past) in itertools.product(_DEGREES, pasts):
        yield degree, own, *_regressed(joined(degree, x, *past), z)


def _widths(x: FloatArray, time: FloatArray, z: FloatArray) -> FloatArray:
    """(d,) half widths that err least: the same for all coordinates, then each in turn, twice."""
    d = x.shape[1]
    best, each = np.ones(d), np.eye(d, dtype=bool)[d == 1 :]
    for chosen in (np.ones(d, bool), *each, *each):
        tried = [np.where(chosen, one, best) for one in _WIDTHS]
        plays, late = Memory(1, np.vstack([plays_of(one) for one in tried]), x).over(x, time)
        pasts = (joined(_DEGREES[-1], x, own, late) for own in np.split(plays, len(tried), axis=1))
        best = tried[int(np.argmin([_missed(_regressed(one, z)[1]) for one in pasts]))]
    return best


def _regressed(features: FloatArray, targets: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Weights and left-out errors of the ridge that errs least."""
    scale = np.abs(features).max(axis=0) + 1e-12
    x = features / scale
    square, onto = x.T @ x, x.T @ targets
    errors = np.zeros((len(_RIDGES), *targets.shape))
    for out in np.array_split(np.arange(len(x)), _FOLDS):
        values, vectors = np.linalg.eigh(square - x[out].T @ x[out])
        along = vectors.T @ (onto - x[out].T @ targets[out])
        weights = along / (np.maximum(values, 0.0)[:, None] + _RIDGES[:, None, None])
        errors[:, out] = targets[out] - x[out] @ vectors @ weights
    best = int(np.argmin(np.mean(errors**2, axis=(1, 2))))
    chosen = np.linalg.solve(square + _RIDGES[best] * np.eye(len(square)), onto)
    return chosen / scale[:, None], errors[best]
