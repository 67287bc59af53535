"""The noise floor: few false alarms, presses found at a stated ratio, honest deviations."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cache, cached_property

import numpy as np
import pytest
from numpy.random import Generator

from shapes import disc
from tomoskin.core import DataError, Detection, FloatArray, Image
from tomoskin.imaging import OneStep
from tomoskin.model.forward import ForwardModel
from tomoskin.model.pattern import Pattern
from tomoskin.model.skin import TouchSettings
from tomoskin.sensing.segment import ImageNoise, Segmenter


@dataclass(frozen=True, eq=False)
class Chain:
    """Operator, floor and Jacobian of a disc at 100 mA, 5 to 20 µV of noise."""

    operator: OneStep
    jacobian: FloatArray
    noise: FloatArray

    @cached_property
    def floor(self) -> ImageNoise:
        return self.floor_of(self.noise)

    def segmenter(self, snr: float, sign: str = "decrease") -> Segmenter:
        settings = TouchSettings(sign=sign, snr=snr)
        return Segmenter(self.operator.model.mesh, settings)

    def begun(self, segmenter: Segmenter, image: Image) -> list[Detection]:
        """What may begin a touch."""
        return [detection for detection in segmenter(image, self.floor) if not detection.weak]

    def image(self, dv: FloatArray, rng: Generator) -> Image:
        return self.operator(dv + self.noise * rng.standard_normal(len(self.noise)))

    def floor_of(self, noise: FloatArray) -> ImageNoise:
        return ImageNoise.of(self.operator.matrix * noise, self.operator.model.mesh.identity)

    def press(self, x: float, y: float, ratio: float) -> FloatArray:
        """Voltages of a press whose image exceeds its noise ``ratio`` times at best."""
        offset = self.operator.model.mesh.centroids - [x, y]
        dv = self.jacobian @ -np.exp(-0.5 * (offset**2).sum(axis=1) / 0.01**2)
        return np.asarray(dv * ratio / (-self.operator(dv).values / self.floor.sd).max())


@cache
def chain() -> Chain:
    return chain_of(8, 500)


@cache
def fine() -> Chain:
    return chain_of(16, 1500)


def chain_of(n: int, cells: int) -> Chain:
    pattern = Pattern.adjacent(n)
    model = ForwardModel(disc(n, cells), pattern, 0.01, current=0.1)
    operator = OneStep(model, "noser", alpha=0.003)
    noise = 1e-5 * np.random.default_rng(0).uniform(0.5, 2.0, pattern.n_meas)
    return Chain(operator, model.jacobian(1.0), noise)


def test_floor_is_the_spread_of_noise_images() -> None:
    rng, n = np.random.default_rng(1), 4000
    images = np.stack([chain().image(np.zeros(40), rng).values for _ in range(n)])
    ratio = images.std(axis=0, ddof=1) / chain().floor.sd
    assert np.abs(ratio - 1).max() < 5 / np.sqrt(2 * (n - 1))


def test_few_false_alarms() -> None:
    rng, n = np.random.default_rng(2), 2000
    segmenter = chain().segmenter(snr=5.0)
    alarms = [chain().begun(segmenter, chain().image(np.zeros(40), rng)) for _ in range(n)]
    assert sum(map(bool, alarms)) == 0


def test_alarms_come_only_where_the_ratio_is_exceeded() -> None:
    rng, segmenter = np.random.default_rng(3), chain().segmenter(snr=2.5)
    found = 0
    for _ in range(300):
        image = chain().image(np.zeros(40), rng)
        detections = chain().begun(segmenter, image)
        found += bool(detections)
        for detection in detections:
            ratio = -image.values[detection.cells] / chain().floor.sd[detection.cells]
            assert ratio.max() >= 2.5
    assert 0 < found < 150
    without_floor = [segmenter(chain().image(np.zeros(40), rng)) for _ in range(100)]
    assert sum(map(bool, without_floor)) > 50


@pytest.mark.parametrize("place", [(0.0, 0.0), (0.04, 0.02), (-0.06, -0.03)])
def test_a_press_at_fifteen_times_the_noise_is_found(place: tuple[float, float]) -> None:
    rng, segmenter, n = np.random.default_rng(4), chain().segmenter(snr=5.0), 200
    dv = chain().press(*place, ratio=15.0)
    detections = [segmenter(chain().image(dv, rng), chain().floor) for _ in range(n)]
    assert all(detections)
    gap = [np.hypot(r[0].x - place[0], r[0].y - place[1]) for r in detections]
    assert np.mean(gap) < 0.01
    assert np.quantile(gap, 0.99) < 0.02


def test_a_press_below_the_ratio_is_no_touch() -> None:
    rng, segmenter = np.random.default_rng(5), chain().segmenter(snr=5.0)
    dv = chain().press(0.0, 0.0, ratio=1.0)
    assert not any(chain().begun(segmenter, chain().image(dv, rng)) for _ in range(200))


def test_between_release_and_onset_ratio_a_reading_is_weak() -> None:
    image = chain().operator(chain().press(0.0, 0.0, ratio=4.0))
    (detection,) = chain().segmenter(snr=5.0)(image, chain().floor)
    assert detection.weak
    assert detection.snr == pytest.approx(4.0, rel=0.05)
    assert chain().segmenter(snr=7.0)(image, chain().floor) == []


def test_a_press_that_another_outshines_is_weak() -> None:
    """Half as strong: below the threshold of the extreme, and no ghost beside the two."""
    strong, faint = (fine().press(x, 0.0, ratio=60.0) for x in (-0.06, 0.06))
    one, other = fine().segmenter(snr=5.0)(fine().operator(strong + 0.5 * faint), fine().floor)
    assert (one.weak, other.weak) == (False, True)
    assert np.hypot(other.x - 0.06, other.y) < 0.01


def test_without_a_floor_no_deviation_is_claimed() -> None:
    image = chain().operator(chain().press(0.0, 0.0, ratio=15.0))
    (detection,) = chain().segmenter(snr=5.0)(image)
    assert np.isnan([detection.sd_x, detection.sd_y]).all()


@pytest.mark.parametrize("sign", ["decrease", "increase", "both"])
@pytest.mark.parametrize(("place", "ratio"), [((0.0, 0.0), 12.0), ((0.04, 0.02), 25.0)])
def test_deviation_of_a_centroid_is_what_noise_makes_of_it(
    sign: str, place: tuple[float, float], ratio: float
) -> None:
    """Cells that cross the threshold move a centroid most; on cells the edge comes in steps."""
    rng, n = np.random.default_rng(6), 200
    segmenter = fine().segmenter(5.0, sign=sign)
    press = fine().press(*place, ratio) * (-1 if sign == "increase" else 1)
    detections = [segmenter(fine().image(press, rng), fine().floor)[0] for _ in range(n)]
    got = np.std([(r.x, r.y) for r in detections], axis=0, ddof=1)
    reported = np.sqrt(np.mean([(r.sd_x**2, r.sd_y**2) for r in detections], axis=0))
    assert ((reported > 0.65 * got) & (reported < 1.5 * got)).all(), reported / got


@pytest.mark.parametrize("sign", [-1.0, 1.0])
@pytest.mark.parametrize("axis", [0, 1])
def test_deviation_of_a_region_that_noise_shifts_is_the_shift(axis: int, sign: float) -> None:
    """One source of noise, and its image is the derivative of the blob: all of it moves."""
    mesh, width, shift = fine().operator.model.mesh, 0.025, 1e-3
    offset = mesh.centroids - [0.01, -0.02]
    blob = sign * np.exp(-0.5 * (offset**2).sum(axis=1) / width**2)
    column = (blob * offset[:, axis] / width**2)[:, None]
    floor = ImageNoise.of(shift * column, mesh.identity)
    (detection,) = fine().segmenter(0.0, sign="both")(Image(blob, "S", mesh.identity), floor)
    expected = np.where(np.arange(2) == axis, shift, 0.0)
    assert (detection.sd_x, detection.sd_y) == pytest.approx(tuple(expected), abs=0.15 * shift)


def test_a_change_of_strength_does_not_move_a_region() -> None:
    mesh = fine().operator.model.mesh
    # lopsided, so that edge and inside pull to one side unless the threshold follows the peak
    x, y = (mesh.centroids / 0.03).T
    blob = np.exp(-(x**2) - y**2) * np.exp(0.8 * x)
    floor = ImageNoise.of(0.1 * blob[:, None], mesh.identity)
    (detection,) = fine().segmenter(0.0, sign="both")(Image(blob, "S", mesh.identity), floor)
    assert np.hypot(detection.sd_x, detection.sd_y) < 3e-4


def test_deviation_scales_with_the_noise() -> None:
    image = fine().operator(fine().press(0.04, 0.02, ratio=20.0))
    twice = fine().floor_of(2 * fine().noise)
    (one,), (two,) = (fine().segmenter(1.0)(image, f) for f in (fine().floor, twice))
    assert (two.sd_x, two.sd_y) == pytest.approx((2 * one.sd_x, 2 * one.sd_y))


def test_a_floor_of_another_mesh_with_as_many_cells_is_refused() -> None:
    image = chain().operator(chain().press(0.0, 0.0, ratio=15.0))
    other = replace(chain().floor, mesh_id="another")
    with pytest.raises(DataError, match=r"noise floor of mesh \w+, got one of mesh another"):
        chain().segmenter(snr=5.0)(image, other)


def test_noise_of_no_channel_is_no_deviation() -> None:
    silent = chain().floor_of(np.zeros(40))
    image = chain().operator(chain().press(0.0, 0.0, ratio=15.0))
    (detection,) = chain().segmenter(snr=5.0)(image, silent)
    assert (detection.sd_x, detection.sd_y) == (0.0, 0.0)
