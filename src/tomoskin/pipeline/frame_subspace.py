"""The nuisance subspace: what the difference data cannot tell, from drift and excluded rows."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from tomoskin.core import FloatArray
from tomoskin.pipeline.prepare import Prepared
from tomoskin.sensing import signal

_KEPT = 8
"""Sets of excluded measurements whose subspace is remembered."""

JUMP = 0.02
"""Standard deviation of a jump of the gain, in parts of it."""

_LEARN = 8
"""Idle blocks after which directions of drift are looked for anew."""


class Drift:
    """Directions along which the skin drifts: its gain, and those learnt while it is idle.

    Attributes
    ----------
    directions
        (n_meas, k) V; the first is the gain: all voltages in proportion, as a conductivity moves
        them that changes everywhere alike. No column where the skin keeps its common modes.
    revision
        How often they have been learnt.
    """

    def __init__(self, prepared: Prepared, reference: signal.Reference) -> None:
        self._projects = prepared.skin.signal.common_modes == "projected"
        gain = reference.mean[:, None]
        self.directions: FloatArray = gain if self._projects else gain[:, :0]
        self.revision = 0

    @property
    def jumps(self) -> FloatArray:
        """(n_meas, k) V: the directions, each as long as the deviation of what it may jump by."""
        size = np.linalg.norm(self.directions, axis=0)
        return np.asarray(JUMP * self.directions * (size[:1] / size))

    def learn(self, baseline: signal.Baseline, signatures: Callable[[], FloatArray]) -> None:
        """Take the end of an idle block.

        ``signatures`` gives (n_meas, n_cells) V, what touches do to the data.
        """
        if not self._projects or baseline.idle.blocks % _LEARN:
            return
        modes = baseline.idle.modes(signatures)
        if modes.shape[1] or self.directions.shape[1] > 1:
            self.directions = np.hstack([self.directions[:, :1], modes])
            self.revision += 1


@dataclass(frozen=True, slots=True, eq=False)
class FrameSubspace:
    """What one frame cannot tell.

    Attributes
    ----------
    nuisance
        Takes it out of difference data.
    drift
        (n_meas, k) V: directions of drift and of excluded measurements alone.
    unknown, jumps
        (n_meas, k) and (n_meas, j) of difference data: all but the drift, and that with a size.
    """

    nuisance: signal.NuisanceSubspace
    drift: FloatArray
    unknown: FloatArray
    jumps: FloatArray


class Nuisance:
    """Subspaces of one operator, by the health of the electrodes.

    Parameters
    ----------
    prepared
        The skin with its operator.
    scale
        (n_meas,) V per unit of difference data.
    drift
        Of the skin.
    """

    def __init__(self, prepared: Prepared, scale: FloatArray, drift: Drift) -> None:
        self._prepared, self._scale, self._drift = prepared, scale, drift
        self._calibrated = prepared.directions
        self._null_space = _null_space(prepared)
        self._kept: dict[tuple[int, bytes], FrameSubspace] = {}
        self._newest: tuple[signal.Health | None, int, FrameSubspace] | None = None

    def __call__(self, health: signal.Health | None) -> FrameSubspace:
        """Of a frame; a monitor gives the same record while all is well."""
        revision = self._drift.revision
        newest = self._newest
        if newest is not None and newest[0] is health and newest[1] == revision:
            return newest[2]
        key = revision, b"" if health is None else health.lost.tobytes() + health.floating.tobytes()
        if key not in self._kept:
            if len(self._kept) >= _KEPT:
                self._kept.pop(next(iter(self._kept)))
            self._kept[key] = self._made(health)
        self._newest = health, revision, self._kept[key]
        return self._kept[key]

    def _made(self, health: signal.Health | None) -> FrameSubspace:
        drift, excluded = self._drift.directions, self._excluded(health)
        scale = self._scale[:, None]
        unknown = np.hstack([self._calibrated, excluded]) / scale
        projected = drift[:, 1:] if self._null_space.shape[1] else drift
        subspace = self._subspace(np.hstack([projected / scale, unknown]))
        return FrameSubspace(
            subspace, np.hstack([drift, excluded]), unknown, self._drift.jumps / scale
        )

    def _excluded(self, health: signal.Health | None) -> FloatArray:
        pattern = self._prepared.pattern
        if health is None:
            return np.zeros((pattern.n_meas, 0))
        return signal.nuisance_directions(pattern, health.lost, health.floating)

    def _subspace(self, directions: FloatArray) -> signal.NuisanceSubspace:
        operator, images = self._prepared.operator, self._null_space
        subspace = signal.NuisanceSubspace.of(directions, operator.precision)
        if not images.shape[1]:
            return subspace
        data = (self._prepared.problem.jacobian @ images).real
        return subspace.without_free(data, (images.T @ operator.matrix).real)


def _null_space(prepared: Prepared) -> FloatArray:
    """(n_cells, k) images in the null space of the prior, which are the gain's."""
    projects = prepared.skin.signal.common_modes == "projected"
    if not projects or prepared.skin.inverse.method != "one-step":
        return np.zeros((len(prepared.mesh.cells), 0))
    return prepared.problem.prior.free
