"""Voltages → difference data: electrode health, the baseline, and what carries no information."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

from tomoskin.core import FloatArray, IntArray, Voltages
from tomoskin.learning import Differences
from tomoskin.model.pattern import Scan
from tomoskin.pipeline.diagnosis import Cause, Diagnosis
from tomoskin.pipeline.frame_subspace import JUMP, Drift, Nuisance
from tomoskin.pipeline.prepare import Prepared
from tomoskin.sensing import signal

MOST_NUISANCE = 0.5
"""No image is made when more than this part of the data carries no information."""

_GAIN, _ALIKE, _COUNTS = 1.25, 0.05, 0.1
"""Another gain: the median voltage has changed by more than the first as a factor, half of all by
the same but for the second as a part; of those that are above the third part of their rms."""

_RENEWAL = 16
"""Blocks of idle frames after which the noise is taken anew, though it is as loud as before."""

_NEW_NOISE = 0.1
"""Noise that has changed by more than this part makes a new noise of the image."""


@dataclass(frozen=True, slots=True, eq=False)
class Conditioned:
    """Difference data of one frame.

    Attributes
    ----------
    differences
        None where too little is left.
    n_excluded
        How many measurements are excluded, or count in a sum only.
    health
        Of the electrodes; None where there are no voltages to tell it from.
    problem
        What is wrong with the voltages as a whole, or None.
    """

    differences: Differences | None
    n_excluded: int
    health: signal.Health | None = None
    problem: Diagnosis | None = None


class Learnt(NamedTuple):
    """What is to be renewed after a frame: what makes images, and what finds touches."""

    image: bool
    touches: bool


class BaselineDifferences:
    """Difference data against a baseline that follows the skin from its reference on.

    Parameters
    ----------
    prepared
        The skin.
    monitor, baseline, drift
        What has been learnt of electrodes and reference.
    health
        Of the electrodes, where it is known.

    Attributes
    ----------
    prepared
        The skin with the operator for the electrodes that are well.
    """

    def __init__(
        self,
        prepared: Prepared,
        monitor: signal.Monitor,
        baseline: signal.Baseline,
        drift: Drift,
        health: signal.Health | None = None,
    ) -> None:
        self._monitor, self._baseline, self._drift = monitor, baseline, drift
        self._scale = _scale(prepared, baseline.start)
        self._has_gain = False
        self._health = health
        self._noise_for: tuple[object, float] = (None, np.nan)
        self._blocks, self._due = baseline.idle.blocks, 1
        self._values, self._excluded = baseline.mean, np.zeros(len(baseline.mean), bool)
        self._levels = _Levels.of(self._values, self._excluded)
        self.renew(prepared)

    @classmethod
    def of(
        cls,
        prepared: Prepared,
        reference: signal.Reference,
        without_reference: NDArray[np.bool_],
        scan: Scan | None,
    ) -> Self:
        """From its ``reference`` on.

        ``without_reference`` (n_meas,) bool: measurements that have none. ``scan``: what samples
        are, where frames bring them; None where there are voltages only.
        """
        monitor = signal.Monitor(
            prepared.pattern,
            reference,
            prepared.operator.reference,
            unusable=without_reference,
            scan=scan,
            rank=_rank(prepared),
            most_own=prepared.readout.own_voltage.large if prepared.skin.chop_frequency else np.inf,
        )
        drift = Drift(prepared, reference)
        return cls(prepared, monitor, _baseline(prepared, reference), drift)

    def with_settings(self, prepared: Prepared, reference: signal.Reference) -> BaselineDifferences:
        """One for other settings of the same skin that goes on where this one is.

        ``reference`` is that which this one was made with.
        """
        baseline, drift = self._baseline, self._drift
        if prepared.skin.signal != self._given.skin.signal:
            baseline, drift = _baseline(prepared, reference), Drift(prepared, reference)
        return BaselineDifferences(prepared, self._monitor, baseline, drift, self._health)

    def renew(self, prepared: Prepared) -> None:
        """Go on with another operator of the same skin."""
        self._given = self.prepared = prepared
        health = self._health
        if health is not None and health.sick:
            lost = signal.nuisance_directions(prepared.pattern, health.lost, health.floating)
            if lost.shape[1] <= MOST_NUISANCE * len(lost):  # else no image is made
                self.prepared = prepared.without_directions(lost / self._scale[:, None])
        self._nuisance = Nuisance(self.prepared, self._scale, self._drift)

    @property
    def reference(self) -> signal.Reference:
        """The baseline of this moment as a reference."""
        return self._baseline.reference

    @property
    def mean(self) -> FloatArray:
        """(n_meas,) V of the untouched skin, as they are known now."""
        return self._baseline.mean

    def volts(self, differences: FloatArray) -> FloatArray:
        """(n_meas,) V of ``differences`` (n_meas,), in the unit of difference data."""
        return np.asarray(differences * self._scale)

    @property
    def state(self) -> signal.BaselineState:
        """The values of the baseline, and how long it has been held."""
        return self._baseline.state

    def subspace(self) -> signal.NuisanceSubspace:
        """The nuisance subspace of late."""
        return self._nuisance(self._health).nuisance

    def expected(self) -> tuple[FloatArray, FloatArray]:
        """Nuisance directions and jumps of the next frame, if all stays as it is."""
        subspace = self._nuisance(self._health)
        return subspace.unknown, subspace.jumps

    def condition(self, measured: Voltages) -> Conditioned:
        """Make difference data of one frame of voltages."""
        values, baseline, unknown = measured.values, self._baseline, measured.excluded
        mean = baseline.mean
        if np.count_nonzero(unknown):
            unknown = unknown & ~np.isfinite(values)
            values = np.where(unknown, mean, values)
        from_rest = values - baseline.start
        health = self._monitor.push(
            values, measured.excluded, measured.time, measured.samples, measured.own
        )
        if np.count_nonzero(unknown):  # what is not there tells nothing of a sum either
            health = replace(health, lost=health.lost | unknown)
        self._values, self._health = values, health
        subspace = self._nuisance(health)
        self._excluded = health.lost
        if np.count_nonzero(health.floating):
            self._excluded = health.lost | health.floating[self.prepared.pattern.measure].any(
                axis=1
            )
        n_excluded = int(np.count_nonzero(self._excluded))
        if n_excluded:
            values = np.where(health.lost, mean, values)
        if subspace.nuisance.directions.shape[1] > MOST_NUISANCE * len(values):
            return Conditioned(None, n_excluded, health)
        if self._levels.mean is not mean or self._levels.excluded is not self._excluded:
            self._levels = _Levels.of(mean, self._excluded)
        times = self._levels.gain(values)
        text = "" if times is None else _gain_text(times)
        problem = Diagnosis(Cause.SUPPLY, text) if text else None
        self._has_gain = times is not None
        if times is not None:
            if self.prepared.skin.signal.common_modes != "projected":
                problem = Diagnosis(Cause.SUPPLY, f"{text}; no image is shown")
                return Conditioned(None, n_excluded, health, problem)
            values = values / times  # touches and noise are then as large as they were learnt
        whole = signal.difference(values, mean, self.prepared.operator.difference)
        differences = Differences(
            dv=subspace.nuisance(whole),
            nuisance=subspace.nuisance.directions,
            whole=whole,
            unknown=subspace.unknown,
            jumps=subspace.jumps,
            wander=baseline.common_deviation / JUMP,
            change=values - mean,
            drift=subspace.drift,
            from_rest=from_rest,
            excluded=health.lost,
        )
        return Conditioned(differences, n_excluded, health, problem)

    def newest(self, values: FloatArray) -> FloatArray | None:
        """Difference data of ``values`` (n_meas,) V that are newer than the newest frame.

        None where that had another gain.
        """
        if self._has_gain:
            return None
        mean = self._baseline.mean
        return signal.difference(values, mean, self.prepared.operator.difference)

    def learn(
        self, time: float, moved: FloatArray | float, *, touched: bool, noise: bool = True
    ) -> Learnt:
        """Take the newest frame, without what of it has ``moved`` V, for the baseline.

        ``noise``: whether what it shows beside the reference is noise that may be learnt.
        """
        health, baseline = self._health, self._baseline
        if health is None or self._has_gain:  # another gain is nothing that the skin does
            return Learnt(image=False, touches=False)
        values = self._values if isinstance(moved, float) else self._values - moved
        if baseline.push(values, self._excluded, time, touched=touched, noise=noise):
            self._drift.learn(baseline, self._signatures)
        level = float(baseline.idle.noise @ baseline.idle.noise)
        sick = tuple((e.electrode, e.state) for e in health.sick)
        states = (sick, self._drift.revision)
        before, then = self._noise_for
        changed = then > 0 and abs(np.log(level / then)) > 2.0 * _NEW_NOISE
        if states == before and not changed:
            return Learnt(image=False, touches=self._learnt_more())
        self._noise_for = (states, level)
        if before is not None and states != before:
            self.renew(self._given)
        return Learnt(image=before is not None, touches=before is not None)

    def _learnt_more(self) -> bool:
        """Whether idle frames tell of the noise what they did not: after one block of them, after
        two more, and ever later."""
        blocks = self._baseline.idle.blocks
        if blocks - self._blocks < self._due:
            return False
        self._blocks, self._due = blocks, min(2 * self._due, _RENEWAL)
        return True

    def _signatures(self) -> FloatArray:
        """(n_meas, n_cells) V: what a change of each cell does."""
        return np.asarray((self.prepared.problem.jacobian * self._scale[:, None]).real)


class GivenDifferences:
    """Difference data that stand in a file, where no reference is known.

    Parameters
    ----------
    prepared
        The skin.
    """

    reference = None
    state = None

    def __init__(self, prepared: Prepared) -> None:
        self.prepared = prepared

    @property
    def mean(self) -> FloatArray:
        """The voltages (n_meas,) of the model, in V."""
        return self.prepared.operator.reference

    def expected(self) -> None:
        """Nuisance directions of the next frame are not known before it."""

    def subspace(self) -> None:
        """The nuisance subspace: given differences have none."""

    def volts(self, differences: FloatArray) -> FloatArray:
        """(n_meas,) V of ``differences`` (n_meas,), in the unit of difference data."""
        return np.asarray(differences * _scale(self.prepared, self.prepared.operator.reference))

    def condition(self, measured: Voltages) -> Conditioned:
        """Of a frame whose values are difference data already."""
        operator, excluded = self.prepared.operator, measured.excluded
        n_excluded = int(np.count_nonzero(excluded))
        if n_excluded > MOST_NUISANCE * len(excluded):
            return Conditioned(None, n_excluded)
        change = measured.values * _scale(self.prepared, operator.reference)
        filled = operator.filled(measured.values, excluded)
        given = Differences.of(filled, np.zeros((len(excluded), 0)), excluded)
        differences = replace(given, change=change, from_rest=change)
        return Conditioned(differences, n_excluded)

    def newest(self, values: FloatArray) -> FloatArray | None:
        """None: given differences come in whole frames."""
        del values
        return None

    def learn(
        self, time: float, moved: FloatArray | float, *, touched: bool, noise: bool = True
    ) -> Learnt:
        """Learn nothing, since no baseline stands behind given differences."""
        del time, moved, touched, noise
        return Learnt(image=False, touches=False)

    def renew(self, prepared: Prepared) -> None:
        """Go on with another operator of the same skin."""
        self.prepared = prepared


Conditioning = BaselineDifferences | GivenDifferences
"""What makes difference data of one frame after the other."""


def _baseline(prepared: Prepared, reference: signal.Reference) -> signal.Baseline:
    return signal.Baseline(reference, follows=prepared.skin.signal.baseline == "follow")


def _scale(prepared: Prepared, reference: FloatArray) -> FloatArray:
    """(n_meas,) V per unit of difference data."""
    if prepared.operator.difference == "plain":
        return np.ones_like(reference)
    return np.abs(reference)


@dataclass(frozen=True, slots=True, eq=False)
class _Levels:
    """What tells of another gain: a ``mean`` (n_meas,) V, and what of it is ``excluded``.

    ``counts`` are the numbers (n,) of the rows that do, and ``usual`` (n,) V what they read.
    """

    mean: FloatArray
    excluded: NDArray[np.bool_]
    counts: IntArray
    usual: FloatArray

    @classmethod
    def of(cls, mean: FloatArray, excluded: NDArray[np.bool_]) -> Self:
        least = _COUNTS * np.sqrt((mean * mean).sum() / len(mean))  # each idle frame asks
        (counts,) = (~excluded & (np.abs(mean) > least)).nonzero()
        return cls(mean, excluded, counts, mean[counts])

    def gain(self, values: FloatArray) -> float | None:
        """By which factor all ``values`` (n_meas,) V have changed, where it is one and far from 1;
        else None."""
        ratio = values[self.counts] / self.usual
        usual = (ratio > 1 / _GAIN) & (ratio < _GAIN)
        if 2 * np.count_nonzero(usual) > len(ratio) or not len(ratio):  # so the median is too
            return None
        times = float(np.median(ratio))
        alike = float(np.median(np.abs(ratio - times))) < _ALIKE * abs(times)
        return times if alike and not 1 / _GAIN < times < _GAIN else None


def _gain_text(times: float) -> str:
    return (
        f"all voltages are {times:.1f} times those of the reference: check current, supply and "
        "gain, and take a new reference"
    )


def _rank(prepared: Prepared) -> IntArray:
    """(n_electrodes,) rank of each electrode along the rim."""
    length = prepared.skin.outline.length
    start = [arc.start % length for arc in prepared.skin.arcs]
    return np.argsort(np.argsort(start))
