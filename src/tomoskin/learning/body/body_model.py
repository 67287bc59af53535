"""What a body that moves does to the voltages: a smooth manifold over its state, what the sheet
remembers, and what is left over."""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Self

import numpy as np

from tomoskin.core import DataError, FloatArray, IntArray
from tomoskin.learning.body.body_examples import MOST_COORDINATES, BodyExamples
from tomoskin.sensing.fit import Whitener

_WIDTHS = (0.03, 0.08, 0.16, 0.3)
"""Half widths of the plays, in parts of the largest of each coordinate."""

_LAGS = (1.0, 30.0)
"""Time constants of what comes late, s."""

_DEGREES = (1, 2, 3)
"""Of the polynomials in the state, among which the data choose."""


class Memory:
    """Features of states x (d,), in parts of the largest: powers, and where it ``remembers`` the
    past, alone and together with the state of the moment.

    What a sheet does late is a sum of plays and low passes of its strain (Krejčí & Kuhnen 2001,
    IEE Proc. Control Theory Appl. 148, 185), which follows the state.

    Parameters
    ----------
    n, degree
        Of the coordinates, and of the highest power.
    plays
        (w, d) where the plays stand at the reference; without them, nothing is remembered.
    """

    def __init__(self, n: int, degree: int, plays: FloatArray | None = None) -> None:
        self._powers = [
            list(chosen)
            for power in range(1, degree + 1)
            for chosen in itertools.combinations_with_replacement(range(n), power)
        ]
        self.remembers = plays is not None
        self._plays = np.zeros((len(_WIDTHS), n)) if plays is None else plays
        self._start = self._plays
        self._late = np.zeros((len(_LAGS), n))
        self._time: float | None = None

    def features(self, x: FloatArray, time: float) -> FloatArray:
        """(f,) features of a state ``x`` (d,) that may be at ``time`` s; all 0 at rest."""
        powers = np.array([x[chosen].prod() for chosen in self._powers])
        if not self.remembers:
            return powers
        plays, late = self._after(x, time)
        past = np.concatenate([(plays - self._start).ravel(), late.ravel()])
        return np.concatenate([powers, past, np.outer(x, past).ravel()])

    def push(self, x: FloatArray, time: float) -> None:
        """Take the state ``x`` (d,) that was at ``time`` s; frames in order."""
        self._plays, self._late = self._after(x, time)
        self._time = time

    def _after(self, x: FloatArray, time: float) -> tuple[FloatArray, FloatArray]:
        step = 0.0 if self._time is None else max(time - self._time, 0.0)
        width = np.array(_WIDTHS)[:, None]
        kept = np.exp(-step / np.array(_LAGS))[:, None]
        return np.clip(self._plays, x - width, x + width), x + (self._late - x) * kept

    @classmethod
    def over(
        cls, x: FloatArray, time: FloatArray, degree: int, plays: FloatArray | None = None
    ) -> FloatArray:
        """(n, f) features of a whole recording (n, d), from its rest on."""
        memory, rows = cls(x.shape[1], degree, plays), []
        for row, now in zip(x, time.tolist(), strict=True):
            rows.append(memory.features(row, now))
            memory.push(row, now)
        return np.array(rows)

    @classmethod
    def plays_after(cls, x: FloatArray) -> FloatArray:
        """(w, d) where the plays stand once a body has been through ``x`` (n, d) and is back."""
        memory = cls(x.shape[1], 1)
        for row in (*x, np.zeros(x.shape[1])):
            memory.push(row, 0.0)
        return memory._plays


_ABOVE = 1.1
"""A direction counts above so many times the edge of noise."""

_MOST = 8

_WORTH = 0.9
"""More features count where squared errors of left-out frames fall to this part by them."""

_SLOPE = 1e-3
"""Step of a slope, in parts of a coordinate's largest."""

_ODD = 5.0
"""Frames are odd that are missed by so many times the median."""

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
    degree, plays
        Of the polynomials, and where the plays of :class:`Memory` stand at the reference; None
        where the sheet's past does not count.
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
    plays: FloatArray | None
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
        fits = [(one, *fit) for one in _with_states(examples, z) for fit in _fits(one, z)]
        best = fits[0]
        for fit in fits[1:]:
            if _missed(fit[-1]) < _WORTH * _missed(best[-1]):
                best = fit
        body, degree, plays, weights, errors = best
        return cls(examples, body, covariance, directions, degree, plays, weights, errors)

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
        return self.plays is not None

    def memory(self) -> Memory:
        """Of a sheet at its reference."""
        return Memory(len(self.body.names), self.degree, self.plays)

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
        ends = [x, *(x + _SLOPE * np.eye(len(x)))]
        rows = np.array([memory.features(end, time) for end in ends]) @ self.weights
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

    @property
    def doubts(self) -> list[str]:
        """What is wrong with the states of the examples, in sentences."""
        away = np.linalg.norm(self.errors, axis=1)
        odd = np.flatnonzero(away > _ODD * max(float(np.median(away)), np.sqrt(self.n_modes)))
        if not len(odd) or not self.examples.names:
            return []
        return [
            f"in {len(odd)} of {len(away)} frames, first in frame {odd[0]}, the voltages do not "
            "follow the states: an encoder has stopped or jumped, or something touched. Touches "
            "are separated all the same; states are less certain, which their deviations say"
        ]

    def changes(self, state: FloatArray, time: FloatArray) -> FloatArray:
        """(n, n_meas) V that the body adds to the reference in a course of states (n, d) at
        ``time`` (n,) s, from rest on: where an encoder tells them."""
        features = Memory.over(state / self.body.size, time, self.degree, self.plays)
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


def _fits(
    examples: BodyExamples, z: FloatArray
) -> Iterator[tuple[int, FloatArray | None, FloatArray, FloatArray]]:
    """Degree, plays, weights and left-out errors: without a memory, and with one."""
    x = examples.state / examples.size
    for degree, plays in itertools.product(_DEGREES, (None, Memory.plays_after(x))):
        yield degree, plays, *_regressed(Memory.over(x, examples.time, degree, plays), z)


def _regressed(features: FloatArray, targets: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Weights and left-out errors of the ridge that errs least."""
    scale = np.abs(features).max(axis=0) + 1e-12
    x = features / scale
    fold = np.arange(len(x)) * _FOLDS // len(x)
    candidates = []
    for ridge in _RIDGES:
        errors = np.zeros_like(targets)
        for k in range(_FOLDS):
            out = fold == k
            errors[out] = targets[out] - x[out] @ _ridge(x[~out], targets[~out], ridge)
        candidates.append((float(np.mean(errors**2)), ridge, errors))
    _, ridge, errors = min(candidates, key=lambda one: one[0])
    return _ridge(x, targets, ridge) / scale[:, None], errors


def _ridge(x: FloatArray, y: FloatArray, ridge: float) -> FloatArray:
    return np.asarray(np.linalg.solve(x.T @ x + ridge * np.eye(x.shape[1]), x.T @ y))
