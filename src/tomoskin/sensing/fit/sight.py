"""How frames are seen: whitened by noise, excluded rows and common modes."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Generator
from operator import is_
from typing import NamedTuple

import numpy as np

from tomoskin.core import FloatArray, finished
from tomoskin.sensing.fit.excess import Channels, Excess, Gauge
from tomoskin.sensing.fit.hypotheses import Jumps
from tomoskin.sensing.fit.noise import Whitener
from tomoskin.sensing.fit.problem import Matched, WhitenedTable
from tomoskin.sensing.fit.spot_model import SpotModel

_MASKS = 8
"""Nuisance subspaces whose whitening is kept."""


_UNKNOWN = 1e6
"""Variance along what is excluded, in parts of the largest one."""


class Seen(NamedTuple):
    """How frames of one noise are seen: the table, candidates, channels and jumps."""

    table: WhitenedTable
    matched: Matched
    gauge: Gauge
    jumps: Jumps

    def louder(self, times: float) -> Seen:
        """The same in so many times the noise's variance."""
        table, matched = self.table.louder(times), self.matched.louder(times)
        return Seen(table, matched, self.gauge, self.jumps.louder(times))


class Sight:
    """How the frames of one finder are seen. What was made for the last ones is kept.

    Parameters
    ----------
    model
        Of the sheet that touches are fitted on.
    channels
        What may turn noisy by itself.
    noise
        (n_meas, n_meas) covariance of difference data.
    gain
        Of the data against the model.

    Attributes
    ----------
    scale
        (n_meas,) from V of the model to difference data.
    """

    def __init__(
        self, model: SpotModel, channels: Channels, noise: FloatArray, gain: float
    ) -> None:
        self._model, self._channels = model, channels
        self.scale = model.scale * gain
        self._noise = noise / self.scale[:, None] / self.scale
        self._nuisance = self._jumps = np.zeros((len(noise), 0))
        self._kept: OrderedDict[bytes, Seen] = OrderedDict()
        self._newest: tuple[tuple[object, ...], Seen] | None = None

    def look(self, nuisance: FloatArray, jumps: FloatArray) -> None:
        """Take what the next frame does not tell: directions (n_meas, k), and jumps (n_meas, j)."""
        self._nuisance, self._jumps = nuisance, jumps

    def renewing(
        self, noise: FloatArray, gain: float, excess: Excess
    ) -> Generator[None, None, None]:
        """Go on with other noise, or another gain, at the end of some pieces of work."""
        scale = self._model.scale * gain
        noise = noise / scale[:, None] / scale
        scaled = self._scaled(scale)
        made = yield from self._making(noise, scaled, excess)
        self.scale, self._noise = scale, noise
        self._kept = OrderedDict({_key(scaled, excess): made})

    def following(self, other: Sight, excess: Excess) -> Generator[None, None, None]:
        """Make ready for frames as those of an ``other``, in pieces of work."""
        self._nuisance, self._jumps = other._nuisance, other._jumps
        scaled = self._scaled(self.scale)
        made = yield from self._making(self._noise, scaled, excess)
        self._kept = OrderedDict({_key(scaled, excess): made})

    def of(self, excess: Excess) -> Seen:
        """How the newest frame is seen: as the one before, where nothing has changed."""
        now, newest = (self._nuisance, self._jumps, self._noise, excess), self._newest
        if newest is None or not all(map(is_, now, newest[0])):
            newest = self._newest = now, self._made(excess)
        return newest[1]

    @property
    def newest(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Nuisance directions, jumps and idle noise of the newest frame."""
        return self._nuisance, self._jumps, self._noise

    def of_newest(self, excess: Excess) -> tuple[FloatArray, FloatArray]:
        """The noise of the newest measurements, (n_meas, n_meas) V² of the
        model, in which what is excluded is unknown; and jumps (n_meas, j) V."""
        nuisance, jumps = self._scaled(self.scale)
        noise = excess.added(self._noise, self._channels)
        if nuisance.shape[1]:
            size = np.linalg.norm(nuisance, axis=0)
            unknown = nuisance / np.where(size > 0, size, 1.0)
            noise = noise + _UNKNOWN * np.diag(noise).max() * unknown @ unknown.T
        return noise, jumps

    def _made(self, excess: Excess) -> Seen:
        scaled = self._scaled(self.scale)
        key = _key(scaled, excess)
        if key not in self._kept:
            self._kept[key] = finished(self._making(self._noise, scaled, excess))
            if len(self._kept) > _MASKS:
                self._kept.popitem(last=False)
        self._kept.move_to_end(key)
        return self._kept[key]

    def _scaled(self, scale: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Nuisance directions and jumps, in V of the model."""
        return self._nuisance / scale[:, None], self._jumps / scale[:, None]

    def _making(
        self, noise: FloatArray, directions: tuple[FloatArray, FloatArray], excess: Excess
    ) -> Generator[None, None, Seen]:
        """What frames of this noise, nuisance subspace and jumps are seen by."""
        model, channels, (nuisance, jumps) = self._model, self._channels, directions
        noise = excess.added(noise, channels)
        white = Whitener.of(noise)
        yield
        white = white.without(nuisance)
        yield
        seen = yield from WhitenedTable.making(model.solver, white, model.response.times, jumps)
        yield
        gauge = yield from Gauge.making(channels, noise, np.hstack([nuisance, jumps]))
        yield
        matched, _ = model.candidates.matched(seen), seen.kept
        rows = (seen.matrix @ jumps).T
        return Seen(seen, matched, gauge, Jumps(rows, np.zeros((0, rows.shape[1]))))


def _key(directions: tuple[FloatArray, ...], excess: Excess) -> bytes:
    return b"".join(part.tobytes() for part in directions) + excess.key
