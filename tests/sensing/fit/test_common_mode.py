"""Central presses change all voltages nearly in proportion; a jump of the common mode is none."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from sensing.fit.scene import covariance, noise, whitener
from sensing.fit.test_finder import NOTHING, data, model, place, press, skin
from tomoskin.core import FloatArray
from tomoskin.sensing.fit import EXHAUSTIVE, LIVE, Pace, SpotFinder, Whitener
from tomoskin.sensing.fit.solver import NumpySolver, SheetDomain

MEAN = model().response.reference
JUMPS = 0.02 * MEAN[:, None]
DEVIATION = 1 / float(np.linalg.norm(whitener()(MEAN)))
"""Part of all voltages that is one deviation of the noise."""


def finder(pace: Pace = LIVE) -> SpotFinder:
    own = covariance() + np.outer(MEAN, MEAN) * 1e-4**2
    return SpotFinder(model(), skin(), skin().mesh(), own, pace=replace(pace, scan_time=0.05))


def counts(ours: SpotFinder, frames: FloatArray) -> list[int]:
    return [len(ours.push(frame, NOTHING, JUMPS)) for frame in frames]


def central(deviations: float) -> FloatArray:
    """(n_meas,) V of a press in the middle that stands out by so much in all."""
    spot = press(0.004, -0.003, 0.02)
    change = data(spot)
    return np.asarray(change * deviations / np.linalg.norm(whitener()(change)))


@pytest.mark.parametrize("pace", [LIVE, EXHAUSTIVE])
def test_a_central_press_is_found_though_little_is_left_beside_the_mean(pace: Pace) -> None:
    change = central(7.0)
    beside = Whitener.of(covariance()).without(MEAN[:, None])(change)
    assert np.linalg.norm(beside) < 5
    for n in noise(16, 8, 1):
        ours = finder(pace)
        counts(ours, noise(16, 2, 2))
        (detection,) = ours.push(change + n, NOTHING, JUMPS)
        assert np.hypot(*(place(detection) - [0.004, -0.003])) < 0.03


@pytest.mark.parametrize("deviations", [4.0, 8.0, 15.0, 60.0, 500.0, -8.0, -60.0, -500.0])
def test_a_jump_is_no_touch_and_its_size_is_told(deviations: float) -> None:
    part = deviations * DEVIATION
    for seed in range(4):
        ours = finder()
        counts(ours, noise(16, 3, seed))
        small = abs(deviations) < 5  # as a faint press would be, which a single frame may be
        assert sum(counts(ours, part * MEAN + noise(16, 20, 10 + seed))) <= small
        if abs(deviations) > 10:
            assert ours.jump == pytest.approx(part / 0.02, rel=0.2)
        assert ours.watch.lifted_problem is None
        assert ours.watch.noise_problem is None
        assert sum(counts(ours, noise(16, 5, 20 + seed))) == 0
        assert ours.jump is None


def test_a_jump_beside_a_touch_leaves_it_alone() -> None:
    ours = finder()
    own = data(press(0.05, 0.02))
    assert counts(ours, own + noise(16, 5, 3)) == [1] * 5
    assert counts(ours, own + 40 * DEVIATION * MEAN + noise(16, 10, 4)) == [1] * 10
    (detection,) = ours.push(own + 40 * DEVIATION * MEAN, NOTHING, JUMPS)
    assert np.hypot(*(place(detection) - [0.05, 0.02])) < 2e-3


def test_where_nothing_may_jump_nothing_is_asked() -> None:
    ours = finder()
    for frame in 8 * DEVIATION * MEAN + noise(16, 3, 5):
        ours.push(frame, NOTHING)
    assert ours.jump is None


def test_numpy_decides_as_native_code_does() -> None:
    frames = np.concatenate([
        noise(16, 2, 6),
        central(9.0) + noise(16, 4, 7),
        noise(16, 4, 8) + 12 * DEVIATION * MEAN,
        noise(16, 3, 9),
    ])  # fmt: skip
    native, numpy = finder(), finder()
    other = model().__class__(**{k: getattr(model(), k) for k in model().__dataclass_fields__})
    for name in ("tabulation", "candidates", "reduced"):
        other.__dict__[name] = getattr(model(), name)
    table, sheet = model().solver.table, SheetDomain(model().response.spots.mesh)
    other.__dict__["solver"] = NumpySolver(table, sheet, model().prior)
    numpy = SpotFinder(
        other,
        skin(),
        skin().mesh(),
        covariance() + np.outer(MEAN, MEAN) * 1e-4**2,
        pace=replace(LIVE, scan_time=0.05),
    )
    for frame in frames:
        ours, theirs = (f.push(frame, NOTHING, JUMPS) for f in (native, numpy))
        assert len(ours) == len(theirs)
        for one, two in zip(ours, theirs, strict=True):
            assert place(one) == pytest.approx(place(two), abs=1e-6)
        assert native.jump == pytest.approx(numpy.jump) if native.jump else numpy.jump is None
