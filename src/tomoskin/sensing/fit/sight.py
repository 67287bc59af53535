"""How frames are seen: whitened by noise, excluded rows and common modes; what a finder knows of
newer measurements, and how touches are shown."""

from __future__ import annotations

import math
from bisect import bisect_left
from collections import OrderedDict
from collections.abc import Callable, Generator
from dataclasses import dataclass
from functools import cached_property, partial
from operator import is_
from typing import NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

from tomoskin.core import Detection, FloatArray, IntArray, finished
from tomoskin.model.mesh import Mesh
from tomoskin.model.skin import Skin
from tomoskin.sensing.fit.deforming import Deforming
from tomoskin.sensing.fit.excess import Channels, Excess, Gauge
from tomoskin.sensing.fit.expectation import ResidualResponse
from tomoskin.sensing.fit.hypotheses import Jumps
from tomoskin.sensing.fit.noise import Whitener
from tomoskin.sensing.fit.problem import Matched, WhitenedTable
from tomoskin.sensing.fit.profile import FILLING
from tomoskin.sensing.fit.spot_model import SpotModel
from tomoskin.sensing.fit.unexplained import FrameWatch

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
    ) -> Generator[None, None, Callable[[], None]]:
        """Pieces of work towards other noise, or another gain; what they return goes on with it."""
        scale = self._model.scale * gain
        noise = noise / scale[:, None] / scale
        scaled = self._scaled(scale)
        made = yield from self._making(noise, scaled, excess)
        kept = OrderedDict({_key(scaled, excess): made})
        return partial(self._adopt, scale, noise, kept)

    def following(self, other: Sight, excess: Excess) -> Generator[None, None, Callable[[], None]]:
        """The same, towards frames as those of an ``other``; see :meth:`renewing`."""
        self._nuisance, self._jumps = other._nuisance, other._jumps
        scaled = self._scaled(self.scale)
        made = yield from self._making(self._noise, scaled, excess)
        kept = OrderedDict({_key(scaled, excess): made})
        return partial(self._adopt, self.scale, self._noise, kept)

    def _adopt(self, scale: FloatArray, noise: FloatArray, kept: OrderedDict[bytes, Seen]) -> None:
        self.scale, self._noise, self._kept = scale, noise, kept

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


NoiseKey = tuple[FloatArray, FloatArray, FloatArray, Excess, tuple[float, ...]]
"""What the noise of the newest measurements depends on: nuisance directions, jumps, noise of idle
frames, excess; and how much of what touches may have left behind is not known."""


@dataclass(frozen=True, eq=False)
class DriveView:
    """The newest measurements as a finder sees them, between two of its frames.

    Attributes
    ----------
    model
        Of the sheet that touches are fitted on.
    skin
        Whose ``[touch]`` says what a touch is.
    cells
        Of the images.
    sight, watch, residual
        How the newest frame was seen, what touches do not explain, and what they left behind.
    deforming
        How the sheet is deformed.
    """

    model: SpotModel
    skin: Skin
    cells: CellDiscs
    sight: Sight
    watch: FrameWatch
    residual: ResidualResponse
    deforming: Deforming

    @property
    def key(self) -> NoiseKey:
        """What the noise of the drives depends on."""
        return *self.sight.newest, self.watch.excess, self.residual.doubts

    def noise(self) -> tuple[FloatArray, FloatArray]:
        """(n_meas, n_meas) V² of the model: of a frame, and of what stays from frame to frame.

        That are jumps, and what touches may have left behind. What is excluded is unknown.
        """
        noise, jumps = self.sight.of_newest(self.watch.excess)
        left = self.residual.doubtful(len(noise))
        return noise, jumps @ jumps.T + left.T @ left

    def change(self, dv: FloatArray) -> FloatArray:
        """(n_meas,) V of the model, of difference data less what touches have left behind, and less
        what a deformation of the sheet does."""
        data = self.residual.without(dv / self.sight.scale)
        return np.asarray(data - self.deforming.moved)

    def spot(self, detection: Detection) -> FloatArray:
        """(4,) of a touch that is shown."""
        part = max(detection.peak / self.skin.conductivity, -0.999)
        content = FILLING * detection.area / math.pi * math.log1p(part)
        log_radius = math.log(detection.area / math.pi) / 2
        return np.array([detection.x, detection.y, log_radius, content])

    def shown(self, spot: FloatArray, spread: FloatArray, ratio: float) -> Detection:
        """A ``spot`` (4,) as a detection; its position has the covariance ``spread`` (2, 2) m²."""
        x, y, log_radius, content = spot.tolist()
        radius = math.exp(log_radius)
        (xx, xy), (_, yy) = spread.tolist()
        return Detection(
            x=x,
            y=y,
            sd_x=math.sqrt(xx),
            sd_y=math.sqrt(yy),
            area=math.pi * radius**2,
            peak=self.skin.conductivity * math.expm1(content / (FILLING * radius**2)),
            cells=self.cells.within(x, y, radius),
            cov_xy=xy,
            snr=ratio,
        )


_MARGIN = 1 + 1e-9
"""Rounding of a radius."""


@dataclass(frozen=True, eq=False)
class CellDiscs:
    """Cells along the x axis: a disc meets few of them.

    Attributes
    ----------
    cells
        (n,) their numbers.
    middles
        (n,) m, x + iy.
    """

    cells: IntArray
    middles: NDArray[np.complex128]

    @classmethod
    def of(cls, mesh: Mesh) -> Self:
        """The cells of a mesh, along its x axis."""
        x, y = mesh.centroids.T
        order = np.argsort(x, kind="stable")
        return cls(order, (x + 1j * y)[order])

    def within(self, x: float, y: float, radius: float) -> IntArray:
        """(m,) those whose middles are no farther than ``radius`` m from ``x``, ``y`` m, or the
        nearest one."""
        along, reach = self._along, radius * _MARGIN
        near = slice(bisect_left(along, x - reach), bisect_left(along, x + reach))
        found = np.abs(self.middles[near] - complex(x, y)) <= radius
        if found.any():
            return np.asarray(self.cells[near].compress(found))
        away = np.abs(self.middles - complex(x, y))
        return np.asarray(self.cells[away == away.min()])

    @cached_property
    def _along(self) -> list[float]:
        return list(map(float, self.middles.real))
