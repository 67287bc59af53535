"""Between voltages and picture: electrode health, the baseline, and what the data cannot tell."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tomoskin.core import FloatArray, IntArray
from tomoskin.pattern import Scan
from tomoskin.pipeline.prepare import Prepared
from tomoskin.signal import (
    Baseline,
    Health,
    Monitor,
    NuisanceSubspace,
    Reference,
    difference,
    nuisance_directions,
)

MOST_BLIND = 0.5
"""No picture is made when more than this part of the data says nothing."""

_NEW_FLOOR = 0.1
"""Noise that has changed by more than this part makes a new floor."""

_KEPT = 8
"""Sets of lost rows whose directions are remembered."""

_LEARN = 8
"""Idle blocks after which directions of drift are looked for anew."""


@dataclass(frozen=True, slots=True, eq=False)
class Seen:
    """One frame: difference data ``dv`` (n_meas,) without what says nothing, None where too
    little is left; ``blind`` what was taken out; ``health``; how many rows are ``left_out`` or
    count in a sum only; ``whole`` (n_meas,) V, what the frame differs by with all that is in it."""

    dv: FloatArray | None
    blind: NuisanceSubspace
    health: Health
    left_out: int
    whole: FloatArray | None = None


class Watch:
    """What follows a skin from its reference on.

    Parameters
    ----------
    prepared
        The skin.
    reference
        What it read while nothing touched.
    unusable
        (n_meas,) bool: rows without a reference.
    scan
        What samples are, where frames bring them; None where there are voltages only.
    """

    def __init__(
        self,
        prepared: Prepared,
        reference: Reference,
        unusable: NDArray[np.bool_],
        scan: Scan | None,
    ) -> None:
        model = prepared.operator.reference
        self._monitor = Monitor(
            prepared.pattern,
            reference,
            model,
            unusable=unusable,
            scan=scan,
            rank=_rank(prepared),
        )
        settings = prepared.skin.signal
        self._projects = settings.common_modes == "projected"
        self._baseline = Baseline(reference, follows=settings.baseline == "follow")
        self._scale = _scale(prepared, reference)
        self._common = self._gain(reference) if self._projects else np.zeros((len(model), 0))
        self._bends = _of_bends(prepared)
        self._bent = np.zeros(len(model))
        self._kept: dict[bytes, NuisanceSubspace] = {}
        self._newest: tuple[Health, NuisanceSubspace] | None = None
        self._learnt = 0
        self._health: Health | None = None
        self._floor_for: tuple[object, float] = (None, np.nan)
        self._values, self._lost = reference.mean, unusable
        self.take(prepared)

    def take(self, prepared: Prepared) -> None:
        """Go on with another operator of the same skin."""
        self._whole = self._prepared = prepared
        self._forget()
        if self._health is not None and self._health.sick:
            lost = nuisance_directions(prepared.pattern, self._health.lost, self._health.floating)
            self._prepared = prepared.blind_to(lost / self._scale[:, None])

    def renewed(
        self, prepared: Prepared, reference: Reference, unusable: NDArray[np.bool_]
    ) -> Watch:
        """One for other settings of the same skin that goes on where this one is.

        ``reference`` and ``unusable`` are those that this one was made with.
        """
        other = Watch(prepared, reference, unusable, prepared.scan)
        other._monitor, other._health = self._monitor, self._health
        if prepared.skin.signal == self._whole.skin.signal:
            other._baseline, other._common = self._baseline, self._common
            other._learnt = self._learnt
        other.take(prepared)
        return other

    @property
    def prepared(self) -> Prepared:
        """The skin with the operator for the electrodes that are well."""
        return self._prepared

    @property
    def baseline(self) -> Baseline:
        """The reference as it is now."""
        return self._baseline

    def look(
        self,
        values: FloatArray,
        railed: NDArray[np.bool_],
        time: float,
        samples: NDArray[np.uint16] | None = None,
    ) -> Seen:
        """Difference data of the frame with ``values`` (n_meas,) V at ``time`` s.

        ``railed`` (n_meas,) bool: rows that stand at a rail or are not finite.
        """
        if railed.any():
            values = np.where(np.isfinite(values), values, self._baseline.mean)
        health = self._monitor.push(values, railed, time, samples)
        self._values, self._health = values, health
        blind = self._blind(health)
        self._lost = health.lost
        if health.floating.any():
            self._lost = health.lost | health.floating[self._prepared.pattern.measure].any(axis=1)
        left_out = int(np.count_nonzero(self._lost))
        if blind.count > MOST_BLIND * len(values):
            return Seen(None, blind, health, left_out)
        if left_out:
            values = np.where(health.lost, self._baseline.mean, values)
        dv = difference(values, self._baseline.mean, self._prepared.operator.difference)
        return Seen(blind(dv), blind, health, left_out, values - self._baseline.mean)

    @property
    def beside_bends(self) -> FloatArray:
        """(n_meas, k) V: what the frame that was looked at last does not tell, but for bends."""
        return np.hstack([self._common, self._lost_directions(self._health)])

    def bent(self, moved: FloatArray) -> None:
        """Say what of the frame that was looked at last, (n_meas,) V, is a bend's."""
        self._bent = moved

    def learn(self, time: float, *, touched: bool) -> bool:
        """Take the frame that was looked at last for the baseline; True where floors change."""
        health = self._health
        if health is None:
            return False
        ended = self._baseline.push(self._values - self._bent, self._lost, time, touched=touched)
        if ended and self._projects and self._baseline.idle.blocks % _LEARN == 0:
            self._learn_modes()
        noise = self._baseline.idle.noise
        level = float(noise @ noise)
        sick = tuple((e.electrode, e.state) for e in health.sick)
        states = (sick, self._learnt)
        before, then = self._floor_for
        changed = then > 0 and abs(np.log(level / then)) > 2.0 * _NEW_FLOOR
        if states == before and not changed:
            return False
        self._floor_for = (states, level)
        if before is not None and states != before:
            self.take(self._whole)
        return before is not None

    def steady(self) -> NuisanceSubspace:
        """What no frame of late has told."""
        return self._blind(self._health)

    def _learn_modes(self) -> None:
        """Directions of drift beside the gain, at the end of an idle block."""
        signatures = self._prepared.problem.jacobian * self._scale[:, None]
        found = self._baseline.idle.modes(signatures.real)
        gain = self._common[:, :1]
        if found.shape[1] or self._common.shape[1] > 1:
            self._common = np.hstack([gain, found])
            self._learnt += 1
            self._forget()

    def _lost_directions(self, health: Health | None) -> FloatArray:
        """(n_meas, k) of rows and readings that ``health`` says nothing is known of."""
        pattern = self._prepared.pattern
        if health is None:
            return np.zeros((pattern.n_meas, 0))
        return nuisance_directions(pattern, health.lost, health.floating)

    def _gain(self, reference: Reference) -> FloatArray:
        """(n_meas, 1): all voltages in proportion, as conductivity does that changes alike."""
        return reference.mean[:, None]

    def _forget(self) -> None:
        self._kept.clear()
        self._newest = None

    def _blind(self, health: Health | None) -> NuisanceSubspace:
        """What that frame does not tell; a monitor gives the same record while all is well."""
        if self._newest is not None and health is self._newest[0]:
            return self._newest[1]
        key = b"" if health is None else health.lost.tobytes() + health.floating.tobytes()
        if key not in self._kept:
            if len(self._kept) >= _KEPT:
                self._kept.pop(next(iter(self._kept)))
            self._kept[key] = self._made(health)
        if health is not None:
            self._newest = health, self._kept[key]
        return self._kept[key]

    def _made(self, health: Health | None) -> NuisanceSubspace:
        operator, free = self._prepared.operator, self._free()
        common = self._common[:, 1:] if free.shape[1] else self._common
        parts = [common, self._bends, self._lost_directions(health)]
        blind = NuisanceSubspace.of(np.hstack(parts) / self._scale[:, None], operator.precision)
        if not free.shape[1]:
            return blind
        seen = (self._prepared.problem.jacobian @ free).real
        return blind.without_free(seen, (free.T @ operator.matrix).real)

    def _free(self) -> FloatArray:
        """(n_cells, k) images that the prior leaves free: those of all conductivity alike, which
        are the gain's."""
        prepared = self._prepared
        if not self._projects or prepared.skin.inverse.method != "one-step":
            return np.zeros((len(prepared.mesh.cells), 0))
        return prepared.problem.prior.free


def _of_bends(prepared: Prepared) -> FloatArray:
    """(n_meas, k) V along which bends move the data."""
    if prepared.bending is None:
        return np.zeros((prepared.pattern.n_meas, 0))
    return prepared.bending.directions


def _scale(prepared: Prepared, reference: Reference) -> FloatArray:
    """(n_meas,) V per unit of difference data."""
    if prepared.operator.difference == "plain":
        return np.ones_like(reference.mean)
    return np.abs(reference.mean)


def _rank(prepared: Prepared) -> IntArray:
    """(n_electrodes,) place of each electrode along the rim."""
    length = prepared.skin.outline.length
    start = [arc.start % length for arc in prepared.skin.arcs]
    return np.argsort(np.argsort(start))
