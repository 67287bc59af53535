"""The noise floor: few false alarms, presses found at a stated ratio, honest deviations."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np
import pytest
from numpy.random import Generator

from shapes import disc
from tomoskin.core import FloatArray, IntArray
from tomoskin.forward import ForwardModel
from tomoskin.inverse import OneStep
from tomoskin.pattern import Pattern
from tomoskin.skin import TouchSettings
from tomoskin.touch import NoiseFloor, Segmenter


@dataclass(frozen=True)
class Chain:
    """Operator, floor and Jacobian of a disc with eight electrodes at 100 mA, 10 µV of noise."""

    operator: OneStep
    jacobian: FloatArray
    noise: FloatArray
    floor: NoiseFloor

    def segmenter(self, snr: float) -> Segmenter:
        settings = TouchSettings(0.65, 0.9, 0.008, "decrease", snr, "centroid", 8)
        return Segmenter(self.operator.model.mesh, settings)

    def image(self, dv: FloatArray, rng: Generator) -> FloatArray:
        return self.operator(dv + self.noise * rng.standard_normal(len(self.noise))).values

    def press(self, x: float, y: float, ratio: float) -> FloatArray:
        """Voltages of a press whose image exceeds its noise ``ratio`` times at best."""
        offset = self.operator.model.mesh.centroids - [x, y]
        dv = self.jacobian @ -np.exp(-0.5 * (offset**2).sum(axis=1) / 0.01**2)
        return np.asarray(dv * ratio / (-self.operator(dv).values / self.floor.sd).max())


@cache
def chain() -> Chain:
    model = ForwardModel(disc(8, 500), Pattern.adjacent(8), 0.01, current=0.1)
    operator = OneStep(model, "noser", alpha=0.003)
    noise = 1e-5 * np.random.default_rng(0).uniform(0.5, 2.0, 40)
    return Chain(operator, model.jacobian(1.0), noise, NoiseFloor.of(operator.matrix, noise))


def test_floor_is_the_spread_of_noise_images() -> None:
    rng, n = np.random.default_rng(1), 4000
    images = np.stack([chain().image(np.zeros(40), rng) for _ in range(n)])
    ratio = images.std(axis=0, ddof=1) / chain().floor.sd
    assert np.abs(ratio - 1).max() < 5 / np.sqrt(2 * (n - 1))


def test_few_false_alarms() -> None:
    rng, n = np.random.default_rng(2), 2000
    segmenter = chain().segmenter(snr=5.0)
    alarms = [segmenter(chain().image(np.zeros(40), rng), chain().floor) for _ in range(n)]
    assert sum(map(bool, alarms)) == 0


def test_alarms_come_only_where_the_ratio_is_exceeded() -> None:
    rng, segmenter = np.random.default_rng(3), chain().segmenter(snr=2.5)
    found = 0
    for _ in range(300):
        image = chain().image(np.zeros(40), rng)
        readings = segmenter(image, chain().floor)
        found += bool(readings)
        for reading in readings:
            ratio = -image[reading.cells] / chain().floor.sd[reading.cells]
            assert ratio.max() >= 2.5
    assert 0 < found < 150
    without_floor = [segmenter(chain().image(np.zeros(40), rng)) for _ in range(100)]
    assert sum(map(bool, without_floor)) > 50


@pytest.mark.parametrize("place", [(0.0, 0.0), (0.04, 0.02), (-0.06, -0.03)])
def test_a_press_at_fifteen_times_the_noise_is_found(place: tuple[float, float]) -> None:
    rng, segmenter, n = np.random.default_rng(4), chain().segmenter(snr=5.0), 200
    dv = chain().press(*place, ratio=15.0)
    readings = [segmenter(chain().image(dv, rng), chain().floor) for _ in range(n)]
    assert all(readings)
    gap = [np.hypot(r[0].x - place[0], r[0].y - place[1]) for r in readings]
    assert np.mean(gap) < 0.01
    assert np.quantile(gap, 0.99) < 0.02


def test_a_press_below_the_ratio_is_no_touch() -> None:
    rng, segmenter = np.random.default_rng(5), chain().segmenter(snr=5.0)
    dv = chain().press(0.0, 0.0, ratio=1.0)
    assert not any(segmenter(chain().image(dv, rng), chain().floor) for _ in range(200))


def test_without_a_floor_no_deviation_is_claimed() -> None:
    image = chain().operator(chain().press(0.0, 0.0, ratio=15.0)).values
    (reading,) = chain().segmenter(snr=5.0)(image)
    assert np.isnan([reading.sd_x, reading.sd_y]).all()


def centroid(cells: IntArray, image: FloatArray) -> FloatArray:
    mesh = chain().operator.model.mesh
    mass = np.abs(image[cells]) * mesh.volumes[cells]
    return np.asarray(mass @ mesh.centroids[cells] / mass.sum())


@pytest.mark.parametrize("place", [(0.0, 0.0), (0.04, 0.02)])
def test_deviation_of_a_centroid_over_given_cells(place: tuple[float, float]) -> None:
    rng, n = np.random.default_rng(6), 3000
    dv = chain().press(*place, ratio=40.0)
    (reading,) = chain().segmenter(snr=5.0)(chain().operator(dv).values, chain().floor)
    cloud = [centroid(reading.cells, chain().image(dv, rng)) for _ in range(n)]
    got = np.std(cloud, axis=0, ddof=1)
    # 4.5 standard errors of a deviation, and 1 % for the second order in 1/ratio
    tolerance = 4.5 / np.sqrt(2 * (n - 1)) + 0.01
    assert (reading.sd_x, reading.sd_y) == pytest.approx(tuple(got), rel=tolerance)


def test_noise_of_no_channel_is_no_deviation() -> None:
    silent = NoiseFloor.of(chain().operator.matrix, np.zeros(40))
    image = chain().operator(chain().press(0.0, 0.0, ratio=15.0)).values
    (reading,) = chain().segmenter(snr=5.0)(image, silent)
    assert (reading.sd_x, reading.sd_y) == (0.0, 0.0)
