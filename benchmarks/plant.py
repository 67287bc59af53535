"""A sheet under flat fingers, independent of twin and fit: its counts, and the least errors."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from tomoskin.core import Frame
from tomoskin.model.forward import ForwardModel
from tomoskin.model.mesh import Mesh, laid_on, triangulate
from tomoskin.model.pattern import Scan
from tomoskin.model.skin import Skin
from tomoskin.sensing.fit import Whitener, row_covariance
from tomoskin.sensing.signal import FIGURES, Readout

CELLS, MESH_SEED = 6600, 4711
SOFT = 0.3
"""The edge of a finger falls between 1 − SOFT and 1 + SOFT of its radius."""

WAVES, LENGTHS, CELLWISE = 200, (0.025, 0.06), 0.3
"""Unevenness: cosines, range of correlation lengths in m, and the part that each cell has alone."""

RANGE = 0.85
"""Part of the converter's range that the untouched sheet takes at most, as its current is set."""

STEPS = (5e-4, 5e-4, 5e-4, 0.02)
"""Of x, y and radius, m, and of the fall, for the bound's derivatives."""

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Finger:
    """A flat touch with a soft edge: the conductivity falls by the part ``fall``; SI units."""

    x: float
    y: float
    radius: float
    fall: float

    @property
    def parameters(self) -> tuple[float, float, float, float]:
        """In the order of :data:`STEPS`."""
        return self.x, self.y, self.radius, self.fall


class Plant:
    """A sheet that is ``uneven`` by that standard deviation of log σ, on a mesh of its own."""

    def __init__(self, skin: Skin, mesh: Mesh, uneven: float, seed: int) -> None:
        self._random = np.random.default_rng(seed)
        self._readout, self._levels = skin.readout, 1 << skin.readout.adc_bits
        self.scan = Scan.of(skin.pattern())
        self.volts = Readout.of(self.scan, skin.readout)
        middles = mesh.points[mesh.cells].mean(axis=1)
        sigma = skin.conductivity * np.exp(uneven * _field(middles, self._random))
        model = ForwardModel(mesh, skin.pattern(), skin.contact_impedance, skin.current)
        largest = float(self._codes(model.at(sigma).transfer_resistance, skin.current).max())
        self._current = skin.current * min(1.0, RANGE * self._levels / largest)
        model = ForwardModel(mesh, skin.pattern(), skin.contact_impedance, self._current)
        self.state = model.at(sigma)
        self._points = np.einsum("qk,ckd->cqd", _inner_points(), mesh.points[mesh.cells])

    def frames(self, presses: Sequence[Finger], count: int = 1) -> Floats:
        """(count, n_meas) V as the read-out gives them."""
        resistance = self.state.local.transfer_resistances_of([self._pressed(presses)])[0]
        codes = self._codes(resistance, self._current)
        return np.array([self.volts(self._frame(codes)).values for _ in range(count)])

    def scan_of(
        self, begin: Sequence[Finger], middle: Sequence[Finger], end: Sequence[Finger]
    ) -> Frame:
        """One frame of what presses at its ``begin``, ``middle`` and ``end``: drives come one after
        the other, and what they see between is a parabola's."""
        found = self.state.local.transfer_resistances_of(
            [self._pressed(presses) for presses in (begin, middle, end)]
        )
        codes = np.array([self._codes(resistance, self._current) for resistance in found])
        part = self.scan.sample_drive / len(self.scan.drives)
        weights = ((2 * part - 1) * (part - 1), 4 * part * (1 - part), part * (2 * part - 1))
        return self._frame(np.einsum("ks,ks->s", weights, codes))

    def least(self, presses: Sequence[Finger], noise: Whitener) -> Floats:
        """(k,) m: root mean square error of each place that no unbiased estimate goes below.

        Cramér–Rao of this very sheet; places, radii and falls of all presses are unknown.
        """
        ends = [
            [*presses[:k], _moved(presses[k], column, sign * step), *presses[k + 1 :]]
            for k in range(len(presses))
            for column, step in enumerate(STEPS)
            for sign in (1, -1)
        ]
        volts = self.state.local.voltages_of([self._pressed(end) for end in ends])
        slopes = noise((volts[::2] - volts[1::2]) / 2)  # by one step, so that all are alike in size
        covariance = np.linalg.inv(slopes @ slopes.T)
        scale = np.tile(STEPS, len(presses))
        variance = (np.diag(covariance) * scale**2).reshape(-1, 4)
        return np.asarray(np.sqrt(variance[:, :2].sum(axis=1)))

    def noise(self, idle: int) -> Whitener:
        """Of a frame less the mean of so many idle ones, by the read-out alone."""
        sample = self.volts.noise / np.sqrt(2) * np.sqrt(1 + 1 / idle)
        return Whitener.of(row_covariance(self.scan, sample))

    def _pressed(self, presses: Sequence[Finger]) -> tuple[NDArray[np.intp], Floats]:
        left = np.ones(len(self._points))
        for finger in presses:
            away = np.linalg.norm(self._points - [finger.x, finger.y], axis=2) / finger.radius
            part = np.clip((away - 1 + SOFT) / (2 * SOFT), 0.0, 1.0)
            left *= 1 - finger.fall * np.mean((1 + np.cos(np.pi * part)) / 2, axis=1)
        cells = np.flatnonzero(left != 1)
        return cells, self.state.conductivity[cells] * left[cells]

    def _codes(self, resistance: Floats, current: float) -> Floats:
        """(n_samples,) what the converter would say without noise and steps."""
        drive, electrode = self.scan.drives[self.scan.sample_drive], self.scan.sample_electrode
        source, sink = drive.T
        seen = resistance[electrode] - resistance[sink]
        rows, r = np.arange(len(drive)), self._readout
        volts = current * (seen[rows, source] - seen[rows, sink])
        return np.asarray((r.gain * volts + r.offset) / r.reference_voltage * self._levels)

    def _frame(self, codes: Floats) -> Frame:
        """Conversions of 10 bits or so, each with its own noise, summed."""
        times = self._readout.oversampling
        noisy = codes + FIGURES.noise * self._random.standard_normal((times, len(codes)))
        counts = np.clip(np.floor(noisy), 0, self._levels - 1).sum(axis=0)
        return Frame(0, 0, 0.0, 1, 0, 0, counts.astype(np.uint16))


def plant_mesh(skin: Skin) -> Mesh:
    """Finer than any that is fitted on, and of another seed."""
    return laid_on(triangulate(skin.outline, skin.arcs, CELLS, seed=MESH_SEED), skin.surface)


def _moved(finger: Finger, column: int, step: float) -> Finger:
    name = ("x", "y", "radius", "fall")[column]
    return replace(finger, **{name: finger.parameters[column] + step})


def _field(points: Floats, random: np.random.Generator) -> Floats:
    """(n,) of unit mean square: a smooth field, and a part that differs from cell to cell."""
    low, high = np.log(LENGTHS).tolist()
    length = np.exp(random.uniform(low, high, WAVES))
    waves = random.standard_normal((WAVES, 2)) / length[:, None]
    phase = random.uniform(0, 2 * np.pi, WAVES)
    smooth = np.cos(points @ waves.T + phase).sum(axis=1) * np.sqrt(2 / WAVES)
    field = smooth + CELLWISE * random.standard_normal(len(points))
    return np.asarray(field / np.sqrt(1 + CELLWISE**2))


def _inner_points() -> Floats:
    """(7, 3) barycentric: the middle of a triangle and six about it, evenly weighed."""
    corner = np.array([[2 / 3, 1 / 6, 1 / 6], [0.1, 0.45, 0.45]])
    about = [np.roll(point, turn) for point in corner for turn in range(3)]
    return np.array([[1 / 3, 1 / 3, 1 / 3], *about])
