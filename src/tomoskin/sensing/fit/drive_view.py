"""What a finder of frames knows of measurements that are newer, and how touches are shown."""

from __future__ import annotations

import math
from bisect import bisect_left
from dataclasses import dataclass
from functools import cached_property
from typing import Self

import numpy as np
from numpy.typing import NDArray

from tomoskin.core import Detection, FloatArray, IntArray
from tomoskin.model.mesh import Mesh
from tomoskin.model.skin import Skin
from tomoskin.sensing.fit.excess import Excess
from tomoskin.sensing.fit.expectation import ResidualResponse
from tomoskin.sensing.fit.sight import Sight
from tomoskin.sensing.fit.spot import FILLING
from tomoskin.sensing.fit.spot_model import SpotModel
from tomoskin.sensing.fit.unexplained import FrameWatch

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
    """

    model: SpotModel
    skin: Skin
    cells: CellDiscs
    sight: Sight
    watch: FrameWatch
    residual: ResidualResponse

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
        """(n_meas,) V of the model, of difference data less what touches have left behind."""
        return self.residual.without(dv / self.sight.scale)

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
